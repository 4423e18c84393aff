"""Force and position low-passed, and what the sensor reads in free air taken off (section 2.1)."""
