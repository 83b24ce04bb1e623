"""What `excite diagnose` says of simulated arms, and how often that is right: for the scripts beside this one.

A machine has the `effect` that is hidden in it (`none` for a clean one), `write(folder)`, `right(effect, joints)` and `told()`.
"""

import argparse
import json
import subprocess
from multiprocessing import Pool
from pathlib import Path


def options(arms, output):
    """A parser of what all scripts ask."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--excite", type=Path, default=Path("target/release/excite"))
    parser.add_argument("--arms", type=int, default=arms)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, nargs="+", help="numbers of the arms that are made, instead of all")
    parser.add_argument("--claim", type=float, default=0.5, help="least confidence of a name that counts")
    parser.add_argument("--output", type=Path, default=Path(output))
    return parser


def diagnosed(machine, folder, asked, passed_over=()):
    """Verdict and claims on one arm, but for names that are passed over."""
    command = [asked.excite, "diagnose", folder / "experiment.toml", "--no-next", "--force", "--output", folder / "gap"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return machine, "failed: " + done.stderr.strip(), []
    found = json.loads((folder / "gap/diagnosis.json").read_text())
    claims = [f for f in found["findings"] if f["confidence"] >= asked.claim and f["effect"] not in passed_over]
    return machine, found["verdict"], [(f["effect"], f["joints"], f["confidence"]) for f in claims]


def count(case, asked, outside):
    """Prints what `case` of each number and the options gives, and how often that is right."""
    named = wrong = clean = quiet = hidden = 0
    numbers = asked.only or range(asked.arms)
    with Pool(2) as pool:
        for number, (machine, verdict, claims) in zip(numbers, pool.imap(case, ((k, asked) for k in numbers))):
            marks = [machine.right(effect, joints) for effect, joints, _ in claims]
            said = "; ".join(
                f"{effect} {','.join(joints)} {confidence:.2f}{'' if mark else ' WRONG'}"
                for (effect, joints, confidence), mark in zip(claims, marks)
            )
            print(f"{number:3} {machine.told()}: {verdict}; {said}", flush=True)
            sound = machine.effect == "none"
            clean, quiet = clean + sound, quiet + (sound and not claims)
            if not sound and machine.effect not in outside:
                hidden, named = hidden + 1, named + any(marks)
            wrong += len(marks) - sum(marks)
    print(f"{quiet} of {clean} clean arms without a name; {named} of {hidden} hidden effects named; {wrong} wrong names")
