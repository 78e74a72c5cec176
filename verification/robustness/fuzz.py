"""Generated scenes and damaged files: each must give a plan, the right content, or a refusal that says what to do.

    uv run python -m verification.robustness.fuzz [scenes | files | pressures | rings] [--count N] [--seed 0]

10 000 scenes, 1 000 files, 2 000 imported pressures and 200 rings when left out. Writes its
parts of docs/robustness.md and docs/robustness.json.
"""

import argparse
import contextlib
import random
import sys
import tempfile
import time
import tomllib
import traceback
from collections import Counter
from pathlib import Path

from verification.pages import need_docs

COUNTS = {"scenes": 10_000, "files": 1_000, "pressures": 2_000, "rings": 200}
PYTHON_EVERY = 4  # every so many scenes also as Python dictionaries
SIMULATED = 4  # of every base
SHORT = {"stop": {"time": 0.01}, "output": {"interval": 0.005}}
TUNNEL = {"cover": 20.0, "outer_diameter": 6.6, "inner_diameter": 5.9, "friction_coefficient": 0.2,
          "lining_density": 2548.0}  # fmt: skip
TWO = {"box.width": 80.0, "tunnels": [{"x": -7.0, **TUNNEL}, {"x": 7.0, **TUNNEL}]}
#: What the generated scenes are made from: changes of the small event.
BASES = {
    "one tunnel": {},
    "without a gate": {"gate": "none"},
    "lowered water": {"water.table_depth": 3.5},
    "two tunnels": TWO,
    "two tunnels without a gate, lowered water": {
        **TWO, "gate": "none", "water.table_depth": 3.5,
    },
}  # fmt: skip
#: Damages by kind of file; a run file takes a second, a scene a millisecond.
SHARES = {"run.nc": 0.15, "checkpoint.h5": 0.3, "run.nc.journal": 0.15, "scene.toml": 0.25, "study.toml": 0.15}
STUDY = """name = "angles"
scene = "quick"
records = 11
[parameters]
"gate.angle" = [45.0, 90.0]
"soils.0.porosity" = [0.4, 0.45]
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", nargs="?", choices=tuple(COUNTS))
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    from verification.robustness.page import write_part

    need_docs()

    faults = 0
    for what in [options.what] if options.what else COUNTS:
        count = options.count or COUNTS[what]
        with tempfile.TemporaryDirectory(prefix="gush-fuzz-") as place:
            begin = time.monotonic()
            result = JUDGES[what](Path(place), count, options.seed)
        result |= {"count": count, "seed": options.seed, "seconds": time.monotonic() - begin}
        write_part(what, result)
        print(what, result["verdicts"], *result["faults"], sep="\n  ")
        faults += len(result["faults"])
    sys.exit(bool(faults))


def scenes(place, count, seed):
    """Judge generated scenes; simulate some of those that can be planned."""
    import coupling
    from verification.robustness import wild_scenes
    from verification.small_event import small_scene

    file, bases = place / "mine.toml", {name: small_scene(**SHORT, **changes).source for name, changes in BASES.items()}
    verdicts, dotted, faults, slowest, planned = Counter(), Counter(), [], 0.0, []
    for number in range(count):
        chance = random.Random(f"{seed} {number}")
        kind = chance.choice(list(bases))
        text = wild_scenes.wild_text(chance, bases[kind])
        file.write_bytes(text.encode("utf-8", "surrogatepass"))
        begin = time.monotonic()
        try:
            verdict, said = wild_scenes.judged(lambda: coupling.load_scene(file), "mine.toml", True)
            if number % PYTHON_EVERY == 0:
                with contextlib.suppress(ValueError, RecursionError):
                    data = tomllib.loads(text)
                    wild_scenes.judged(lambda data=data: coupling.make_scene(data, "dictionary"), "dictionary", False)
            if number % PYTHON_EVERY == 1:
                dotted[changed_by_names(chance, place, kind, bases[kind])] += 1
        except Exception:
            verdict, said = "fault", traceback.format_exc()
            faults.append(f"scene {number}: {said[-300:]}")
        slowest = max(slowest, time.monotonic() - begin)
        verdicts[verdict if verdict != "warned" else "planned with a warning"] += 1
        if verdict in ("planned", "warned"):
            planned.append((kind, text))
    # compiles what the children, which share this process's memory, then find ready
    for kind, changes in BASES.items():
        coupling.run(small_scene(**SHORT, **changes), place / "compiled" / kind.replace(" ", "-"), threads=1)
    simulated = []
    for kind in bases:
        texts = [text for of, text in planned if of == kind]
        simulated += random.Random(seed).sample(texts, min(SIMULATED, len(texts)))
    for number, text in enumerate(simulated):
        fault = simulation_fault(place, text, number)
        faults += [fault] if fault else []
    return {
        "verdicts": dict(verdicts.most_common()), "faults": faults, "slowest_seconds": slowest,
        "bases": list(bases), "dotted": dict(dotted.most_common()),
        "python_every": PYTHON_EVERY, "simulated": len(simulated), "patience": wild_scenes.PATIENCE,
    }  # fmt: skip


def changed_by_names(chance, place, kind, text):
    """Verdict on a good scene that is changed by dotted names, right and wrong ones."""
    import coupling
    from verification.robustness import wild_scenes

    file = place / f"{kind.replace(' ', '-')}.toml"
    file.write_text(text, encoding="utf-8")
    changes, (name, expected) = wild_scenes.wild_changes(chance)
    verdict, _ = wild_scenes.judged(lambda: coupling.load_scene(file, **changes), "scene", False)
    if verdict != "refused":
        found = wild_scenes.value_at(coupling.load_scene(file, **changes), name)
        assert abs(found - expected) <= 1e-12 * expected, f"{changes}: {name} is {found}"
    return verdict


def simulation_fault(place, text, number):
    """What is wrong with how a scene runs, "" where it ends well: finished and finite, or failed with a reason."""
    import numpy as np

    from coupling import load_scene, run
    from coupling.datasets import raw_groups
    from verification.robustness.damaged_files import in_a_process

    scene = place / f"run-{number}.toml"
    scene.write_text(text, encoding="utf-8")
    loaded = load_scene(scene)
    if loaded.estimated_elements > 20_000 or (loaded.stop.time or 1.0) > 0.1:
        return ""

    def work():
        folder = place / f"run-{number}"
        run(loaded, folder, threads=1)
        return bool(all(np.isfinite(a).all() for a in raw_groups(folder, ("lining", "history"))["lining"].values()))

    how, answer = in_a_process(work, 120)
    if how == "raised" and answer[0] & {"RunFailed", "MeshError", "Refused"}:
        return ""
    return "" if (how, answer) == ("returned", True) else f"run of scene {number} {how}: {str(answer)[-300:]}"


def files(place, count, seed):
    """Judge damaged files of every kind."""
    from verification.robustness import damaged_files

    good = good_files(place / "whole")
    verdicts, faults = {}, []
    for kind, share in SHARES.items():
        reader, _ = damaged_files.READERS[kind]
        target, counts = place / f"damaged {kind}" / kind, Counter()
        target.parent.mkdir()
        if kind.endswith(".journal"):
            (target.parent / "run.nc").write_bytes(good["run.nc"].read_bytes())
            before = reader(target)
        else:
            before = None
        target.write_bytes(good[kind].read_bytes())
        content, whole = good[kind].read_bytes(), reader(target)
        for number in range(round(share * count)):
            target.write_bytes(damaged_files.damaged(random.Random(f"{seed} {kind} {number}"), content))
            try:
                verdict = damaged_files.judged(target, kind, whole, before)
            except AssertionError as fault:
                verdict = "fault"
                faults.append(f"{kind} {number}: {str(fault)[-300:]}")
            counts[verdict] += 1
        verdicts[kind] = dict(counts.most_common())
    return {"verdicts": verdicts, "faults": faults, "patience": damaged_files.PATIENCE}


def good_files(place):
    """One whole file of every kind, by kind."""
    import h5netcdf
    import numpy as np

    from coupling.datasets import CHECKED_FORMAT
    from coupling.files import checkpoint, journal
    from verification.small_event import small_scene
    from verification.synthetic_run import write_run

    place.mkdir()
    run = write_run(place / "run.nc", times=(0.0, 0.5), models=("beam-spring",))
    change = place / "change"
    with journal.Overlay(run) as overlay:
        with h5netcdf.File(overlay, "r+", libver=CHECKED_FORMAT) as file:
            file["lining"]["soil_pressure"][0, :] = 1.0
        journal._write_journal(change, overlay.all_pages(), overlay.size)
    state = {"step_count": 7, "time": 0.1, "points": np.random.default_rng(1).normal(size=(20, 2000))}
    stored = checkpoint.write_checkpoint(place, state, {"records": 3})
    (place / "scene.toml").write_text(small_scene().source, encoding="utf-8")
    (place / "study.toml").write_text(STUDY, encoding="utf-8")
    return {
        "run.nc": run, "checkpoint.h5": stored, "run.nc.journal": change, "scene.toml": place / "scene.toml",
        "study.toml": place / "study.toml",
    }  # fmt: skip


def pressures(place, count, seed):
    """Judge files of imported pressures with mistakes of which the generator knows what was meant."""
    import coupling
    from verification.robustness import wild_pressures

    ring, file = coupling.load_scene("case-3").ring.model_dump_json(), place / "mine.nc"
    verdicts, faults = {}, []
    for number in range(count):
        given, true, kind = wild_pressures.wild_pressures(random.Random(f"{seed} {number}"))
        given.assign_attrs(ring=ring).to_netcdf(file, engine="h5netcdf")
        try:
            verdict = wild_pressures.judged(file, true, kind)
        except Exception:
            verdict = "fault"
            faults.append(f"{kind} {number}: {traceback.format_exc()[-300:]}")
        verdicts.setdefault(kind, Counter())[verdict] += 1
    return {"verdicts": {kind: dict(verdicts[kind]) for kind in sorted(verdicts)}, "faults": faults,
            "patience": wild_pressures.PATIENCE}  # fmt: skip


def rings(place, count, seed):
    """Random rings under random balanced loads by both models: solved by both, or refused by both with a reason."""
    import numpy as np

    from structure import BeamSpringLining, ContinuumLining
    from verification.robustness.random_rings import SPRINGS, outcome, random_balanced_loads, random_ring, reason

    models = BeamSpringLining, ContinuumLining
    rng, kinds = np.random.default_rng(seed), list(SPRINGS.values())
    verdicts, reasons, faults, differences = Counter(), Counter(), [], []
    for number in range(count):
        ring, loads = random_ring(rng, kinds[number % len(kinds)]), random_balanced_loads(rng)
        try:
            answers = [outcome(model, ring, loads) for model in models]
        except Exception:
            faults.append(f"ring {number}: {traceback.format_exc()[-300:]}")
            continue
        refused = [isinstance(answer, str) for answer in answers]
        verdicts[{0: "solved by both", 1: "refused by one", 2: "refused by both"}[sum(refused)]] += 1
        if sum(refused) == 1:
            faults.append(f"ring {number}: only one model refused: {answers[refused.index(True)]}")
        elif all(refused):
            for model, answer in zip(models, answers, strict=True):
                said, holds = reason(model, ring, loads, answer)
                reasons[said] += 1
                if not holds:
                    faults.append(f"ring {number}: reason that does not hold: {answer}")
        else:
            thrusts = [answer["axial_force"].mean().item() for answer in answers]
            differences.append(abs(thrusts[1] / thrusts[0] - 1))
            if not all(answer["equilibrium_residual"] < 1e-8 for answer in answers):
                faults.append(f"ring {number}: not in equilibrium")
    return {"verdicts": dict(verdicts.most_common()), "reasons": dict(reasons.most_common()), "faults": faults,
            "largest_difference": max(differences, default=0.0)}  # fmt: skip


JUDGES = {"scenes": scenes, "files": files, "pressures": pressures, "rings": rings}


if __name__ == "__main__":
    main()
