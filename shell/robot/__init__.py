"""Who moves the tip when `palpate explore` asks for a touch: the laboratory, or a robot by lines of JSON."""
