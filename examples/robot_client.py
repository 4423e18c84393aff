"""A robot that explores by `palpate explore --robot`: suggestion in, touch, what was felt out, line by line.

Here the laboratory's phantom stands in for the robot's arm: replace `touch` with your own. Run as
`python examples/robot_client.py OUT.csv.gz`.
"""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np

from palpate.diagnosis.explore.explorer import Suggestion
from palpate.robot import LaboratoryRobot
from palpate.scenes.phantoms import phantom


def main(output: str, most: int = 8) -> dict:
    """Explore the dome until the goals are met or `most` presses were made; returns the last state."""
    arm = LaboratoryRobot(phantom("dome"), seed=4)
    words = [sys.executable, "-m", "palpate", "explore", "--robot", "-o", output, "--most", str(most)]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as explorer:
        assert explorer.stdin is not None and explorer.stdout is not None
        for line in explorer.stdout:
            said = json.loads(line)
            suggest = said["suggest"]
            print(suggest["kind"], suggest.get("point"), suggest["why"])
            if suggest["kind"] == "stop":
                return said["state"]
            felt = touch(arm, suggest)
            explorer.stdin.write(json.dumps(felt) + "\n")
            explorer.stdin.flush()
    raise RuntimeError("the explorer ended before it said stop")


def touch(arm: LaboratoryRobot, suggest: dict) -> dict:
    """Carry a suggestion out; SI units, device frame, force on the tool."""
    words = {k: v for k, v in suggest.items() if k not in ("kind", "why", "seconds")}
    for name in ("point", "normal"):
        if name in words:
            words[name] = np.array(words[name])
    felt = arm.carry_out(Suggestion(suggest["kind"], suggest["why"], **words))
    answer = {"segment": felt.kind, "t": felt.t.tolist(), "position": felt.position.tolist()}
    answer["force"] = felt.force.tolist()
    if felt.quaternion is not None:
        answer["quaternion"] = felt.quaternion.tolist()
    return answer


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1]), indent=1))
