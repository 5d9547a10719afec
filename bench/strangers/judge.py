"""What `dqwatch trace` said of a foreign log, beside the truth."""

from __future__ import annotations

import json
import math
import pathlib
import resource
import subprocess

PARAMETERS = ("R_ohm", "Ld_H", "Lq_H", "psi_Wb")
# Below this the noise covers what is wrong: names that are true are enough, also none.
HIDDEN = 1.5
# A parameter of the truth that moves with what the effect names is read where the effect is nought.
MOVES = {"winding_temperature": "R_ohm", "magnet_temperature": "psi_Wb", "saturation": "LdLq",
         "cross_saturation": "LdLq"}

# A mean over rows is a lag of the currents, and voltages some rows later act that late: right, if it is said.
MAY_BE = {"filtered": {"sensor_lag", "sample_shift"}, "rows_apart": {"delay", "sample_shift"}}


def usable(parameter: dict) -> bool:
    """As the command says; before it did, by its rule."""
    if "usable" in parameter:
        return bool(parameter["usable"])
    return parameter["value"] > 0 and 3 * parameter.get("sd", math.inf) < 0.1 * parameter["value"]


def off(value: float, truth: list[float], at_rest: bool) -> float:
    """Error over the truth; where the truth moves and nothing says so, to the nearest that it was."""
    start, least, most = truth
    if at_rest:
        return value / start - 1
    return value / min(max(value, least), most) - 1


def matched(truth: list[list[str]], names: list[str], others: list[list[str]]) -> bool:
    """Each true one is named or a look-alike of a named one; each named one is true or has a true look-alike."""
    meant = [{name, *other} for name, other in zip(names, others)]
    wanted = [set(t) for t in truth]
    return all(any(w & m for m in meant) for w in wanted) and all(any(w & m for w in wanted) for m in meant)


def score(truth: dict, said: dict) -> dict:
    names = [e["name"] for e in said.get("effects", [])]
    others = [e.get("confusable_with", []) for e in said.get("effects", [])]
    kind, strength = truth["spec"]["kind"], truth["strength"]
    if kind in ("clean", "outside"):
        allowed = set().union(*(MAY_BE.get(name, set()) for name in truth["spec"]["outside"]))
        right = set(names) <= allowed
    else:
        right = matched(truth["truth"], names, others)
    hidden = kind in ("one", "two", "outside") and strength < HIDDEN
    moved = {MOVES[name] for name in names if name in MOVES}
    # R is then phase c's; which one that is only an angle tells.
    if "phase_resistance_imbalance" in names and truth["spec"]["log"]["theta"]:
        moved.add("R_ohm")
    parameters = {}
    for name in PARAMETERS:
        p = said.get("after", {}).get("parameters", {}).get(name)
        if not p or p.get("given"):
            continue
        at_rest = name in moved or (name in ("Ld_H", "Lq_H") and "LdLq" in moved)
        error = off(p["value"], truth["parameters"][name], at_rest)
        parameters[name] = {"error": error, "sd": p.get("sd", 0.0) / abs(p["value"]) if p["value"] else math.inf,
                            "usable": usable(p)}
    true_alone = kind in ("one", "two") and all(
        any({name, *other} & set(t) for t in truth["truth"]) for name, other in zip(names, others))
    return {"right": right or (hidden and true_alone), "hidden": hidden, "named": names, "others": others,
            "verdict": said.get("verdict", "failed"), "parameters": parameters,
            "confidence": [e.get("confidence") for e in said.get("effects", [])]}


def again(file: pathlib.Path, answer: dict) -> dict:
    """The answer that is kept, judged anew."""
    said = file.parent / "trace" / file.name.removesuffix(".truth.json") / "trace.json"
    if answer["failure"] or not said.exists():
        return answer
    return answer | score(json.loads(file.read_text()), json.loads(said.read_text()))


def one(job: tuple[pathlib.Path, pathlib.Path]) -> dict:
    """Traces the log beside its truth file; its line of the table. `seconds` is processor time."""
    dqwatch, file = job
    truth = json.loads(file.read_text())
    csv = file.parent / (file.name.removesuffix(".truth.json") + ".csv")
    out = file.parent / "trace" / csv.stem
    out.mkdir(parents=True, exist_ok=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([dqwatch, "trace", str(csv), "--json", "--out", str(out)], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    said = json.loads(done.stdout) if done.returncode == 0 else {}
    spec = truth["spec"]
    return {"seed": spec["seed"], "simulator": spec["simulator"], "plate": spec["plate"], "kind": spec["kind"],
            "truth": truth["truth"], "effects": spec["effects"], "outside": spec["outside"],
            "strength": truth["strength"],
            "seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
            "failure": "" if done.returncode == 0 else f"status {done.returncode}: {done.stderr.strip()[-200:]}",
            **score(truth, said)}
