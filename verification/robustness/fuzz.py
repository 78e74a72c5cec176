"""Generated scenes, damaged files, imported pressures, random rings: each must give a plan, the right content, or a
refusal that says what to do.

Every measurement takes a folder to work in, a number of tries and a seed, and returns a dict: verdicts, faults, further
numbers.
"""

import contextlib
import random
import time
import tomllib
import traceback
from collections import Counter

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


def scenes(place, count, seed):
    """Judge generated scenes; simulate some of those that can be planned."""
    import coupling
    from verification.robustness import wild_scenes
    from verification.small_event import small_scene

    file, bases = place / "mine.toml", {name: small_scene(**SHORT, **changes).source for name, changes in BASES.items()}
    verdicts, dotted, slowest, planned = Counter(), Counter(), 0.0, []

    def one(chance, number):
        nonlocal slowest
        kind = chance.choice(list(bases))
        text = wild_scenes.wild_text(chance, bases[kind])
        file.write_bytes(text.encode("utf-8", "surrogatepass"))
        begin = time.monotonic()
        verdict, _ = wild_scenes.judged(lambda: coupling.load_scene(file), "mine.toml", True)
        if number % PYTHON_EVERY == 0:
            with contextlib.suppress(ValueError, RecursionError):
                data = tomllib.loads(text)
                wild_scenes.judged(lambda: coupling.make_scene(data, "dictionary"), "dictionary", False)
        if number % PYTHON_EVERY == 1:
            dotted[changed_by_names(chance, place, kind, bases[kind])] += 1
        slowest = max(slowest, time.monotonic() - begin)
        verdicts[verdict if verdict != "warned" else "planned with a warning"] += 1
        if verdict in ("planned", "warned"):
            planned.append((kind, text))

    faults = each(count, seed, "", one)
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
        "dotted": dict(dotted.most_common()), "simulated": len(simulated),
    }  # fmt: skip


def changed_by_names(chance, place, kind, text):
    """Verdict on a good scene that is changed by dotted names, right and wrong ones."""
    import coupling
    from verification.robustness import wild_scenes
    from verification.sensitivity.variants import value_at

    file = place / f"{kind.replace(' ', '-')}.toml"
    file.write_text(text, encoding="utf-8")
    changes, (name, expected) = wild_scenes.wild_changes(chance)
    verdict, _ = wild_scenes.judged(lambda: coupling.load_scene(file, **changes), "scene", False)
    if verdict != "refused":
        found = value_at(coupling.load_scene(file, **changes), name)
        assert abs(found - expected) <= 1e-12 * expected, f"{changes}: {name} is {found}"
    return verdict


def simulation_fault(place, text, number):
    """What is wrong with how a scene runs, "" where it ends well: finished and finite, or failed with a reason."""
    import numpy as np

    from coupling import load_scene, run
    from coupling.datasets import raw_groups
    from mpm.memory import estimated_elements
    from verification.child import in_a_process

    scene = place / f"run-{number}.toml"
    scene.write_text(text, encoding="utf-8")
    loaded = load_scene(scene)
    if estimated_elements(loaded) > 20_000 or (loaded.stop.time or 1.0) > 0.1:
        return ""

    def work():
        folder = place / f"run-{number}"
        run(loaded, folder, threads=1)
        return bool(all(np.isfinite(a).all() for a in raw_groups(folder, ("lining", "history"))["lining"].values()))

    how, answer = in_a_process(work, 120)
    if how == "raised" and answer[0] & {"RunFailed", "MeshError", "Refused"}:
        return ""
    return "" if (how, answer) == ("returned", True) else f"run of scene {number} {how}: {str(answer)[-300:]}"


def each(count, seed, what, one):
    """Call `one` with a random.Random and its number, so often; the faults, each with the end of what was said."""
    faults = []
    for number in range(count):
        try:
            one(random.Random(f"{seed} {what} {number}" if what else f"{seed} {number}"), number)
        except Exception:
            faults.append(f"{what} {number}: {traceback.format_exc()[-300:]}")
    return faults


def files(place, count, seed):
    """Judge damaged files of every kind."""
    from verification.robustness import damaged_files

    good, verdicts, faults = good_files(place / "whole"), {}, []
    for kind, share in SHARES.items():
        reader, _ = damaged_files.READERS[kind]
        target, counts, before = place / f"damaged {kind}" / kind, Counter(), None
        target.parent.mkdir()
        if kind.endswith(".journal"):
            (target.parent / "run.nc").write_bytes(good["run.nc"].read_bytes())
            before = reader(target)
        content = good[kind].read_bytes()
        target.write_bytes(content)
        whole = reader(target)

        def one(chance, number, target=target, kind=kind, content=content, whole=whole, before=before, counts=counts):
            target.write_bytes(damaged_files.damaged(chance, content))
            counts[damaged_files.judged(target, kind, whole, before)] += 1

        found = each(round(share * count), seed, kind, one)
        verdicts[kind] = dict(counts.most_common()) | ({"fault": len(found)} if found else {})
        faults += found
    return {"verdicts": verdicts, "faults": faults}


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
    verdicts = {}

    def one(chance, number):
        given, true, kind = wild_pressures.wild_pressures(chance)
        given.assign_attrs(ring=ring).to_netcdf(file, engine="h5netcdf")
        verdict = wild_pressures.judged(file, true, kind)
        verdicts.setdefault(kind, Counter())[verdict] += 1

    faults = each(count, seed, "", one)
    return {"verdicts": {kind: dict(verdicts[kind]) for kind in sorted(verdicts)}, "faults": faults}


def rings(place, count, seed):
    """Random rings under random balanced loads by both models: solved by both, or refused by both with a reason."""
    import numpy as np

    from structure import BeamSpringLining, ContinuumLining
    from verification.robustness.random_rings import SPRINGS, outcome, random_balanced_loads, random_ring, reason

    models = BeamSpringLining, ContinuumLining
    rng, kinds = np.random.default_rng(seed), list(SPRINGS.values())
    verdicts, reasons, differences = Counter(), Counter(), []

    def one(_, number):
        ring, loads = random_ring(rng, kinds[number % len(kinds)]), random_balanced_loads(rng)
        answers = [outcome(model, ring, loads) for model in models]
        refused = [isinstance(answer, str) for answer in answers]
        verdicts[{0: "solved by both", 1: "refused by one", 2: "refused by both"}[sum(refused)]] += 1
        assert sum(refused) != 1, f"only one model refused: {answers[refused.index(True)]}"
        if all(refused):
            for model, answer in zip(models, answers, strict=True):
                said, holds = reason(model, ring, loads, answer)
                reasons[said] += 1
                assert holds, f"reason that does not hold: {answer}"
        else:
            thrusts = [answer["axial_force"].mean().item() for answer in answers]
            differences.append(abs(thrusts[1] / thrusts[0] - 1))
            assert all(answer["equilibrium_residual"] < 1e-8 for answer in answers), "not in equilibrium"

    faults = each(count, seed, "ring", one)
    return {"verdicts": dict(verdicts.most_common()), "reasons": dict(reasons.most_common()), "faults": faults,
            "largest_difference": max(differences, default=0.0)}  # fmt: skip
