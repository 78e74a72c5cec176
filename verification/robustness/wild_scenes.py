"""Scenes as nobody should write them, made from good ones, and what has to become of them."""

import json
import math
import re
import time

import coupling
from coupling.files.folder import default_folder
from coupling.refused import Refused
from coupling.runs.plan import rough_plan
from coupling.scenes.plausibility import warnings_of

#: Longest that judging a scene may take [s]; usual are some milliseconds.
PATIENCE = 5.0
#: TOML spelling of values that no scene has; `None` in Python has none.
STRANGE = (
    "nan", "inf", "-inf", "true", "false", "[]", "{}", '""', '"20 kg"', '"45 %"', '"9**9**9**9 m"', '"1e999 m"', '"m"',
    '"40 MPa"', '"25 deg"', '"__import__(1)"', "1979-05-27", "07:32:00", "[[[[1.0]]]]", "{a = {b = 1}}", "0", "-1.0",
    "1e308", "-1e308", "5e-324", "1" + 400 * "0", "0x" + 900 * "f", '"\\u001b[2J\\u0007"', '"[/red]"',
    '"' + 3000 * "x" + '"', '"../../x"', '".."', '"http://127.0.0.1/x"', '"file:///etc/passwd"',
)  # fmt: skip
NAMES = (
    '"../../x"', '".."', '"."', '"/tmp/x"', '"a/b"', '"-rf"', '"x\\u0000"', '"x\\n"', '""', '"ÿ-1"',
    '"' + 90 * "x" + '"',
)  # fmt: skip
BASES = (
    '"/dev/zero"', '"/dev/stdin"', '"http://127.0.0.1/x.toml"', '"mine.toml"', '"."', '"/proc/self/mem"', '"quik"', "3",
    '"x\\u0000"', '"' + 5000 * "a" + '"', '"../../../../etc/passwd"', '"case-4"',
)  # fmt: skip
WORDS = (
    "phi", "friction", "frictionangle", "E", "porosty", "K0", "gaet", "widht", "__class__", "a.b", "''", '"\\u001b"',
)  # fmt: skip


def wild_text(random, base):
    """TOML text of a scene with some damage.

    random : random.Random;  base : a good scene's complete text, one key a line.
    """
    lines = base.splitlines()
    if random.random() < 0.5:  # else K0 is that of gravity loading
        lines.insert(1 + next(i for i, line in enumerate(lines) if line.startswith("grain_density")), "k0 = 0.5")
    for _ in range(random.choice((0, 1, 1, 1, 2, 3, 6))):
        _change(random, lines)
    text = "\n".join(lines) + "\n"
    if random.random() < 0.15:
        text = _torn(random, text)
    return text


#: Dotted names with right values, as given and as they have to be read.
RIGHT = (
    ("soils.0.friction_angle", 33, 33.0), ("soils.0.friction_angle", "0.5 rad", 28.64788975654116),
    ("soils.0.youngs_modulus", "30 MPa", 3e7), ("soils.0.cohesion", "2 kPa", 2e3), ("soils.0.porosity", "44 %", 0.44),
    ("soils.0.hydraulic_conductivity", "8.64 m/day", 1e-4), ("stop.time", "20 ms", 0.02),
    ("discretisation.element_size", "600 cm", 6.0), ("gravity", "981 cm/s^2", 9.81), ("water.density", 1010, 1010.0),
    ("soils.0.k0", 0.5, 0.5),
)  # fmt: skip
#: Dotted names, most of which name nothing.
DOTTED = (
    "soils.1.k0", "soils.-1.k0", "soils.0.phi", "soils..k0", "soils.0", "soils.0.k0.x", "soils", "soils.x.k0", "", ".",
    "gate.angle", "gate.widht", "gate", "water.table_depth", "water", "tunnels.1.x", "tunnels.7.x", "tunnels.0.cover",
    "ring.ground.cohesion", "ring.concrete_modulus", "ring.ground", "ring.joint_angles.0", "numerics.courant_number",
    "name", "name.x", "base", "base.x", "output.interval", "soils." + 5000 * "9" + ".k0", "a" + 3000 * ".a",
    "soils.\u0663.k0", "soils.0.name", "__class__.__init__", "box.width", "stop.inflow_mass",
)  # fmt: skip
VALUES = (
    0, -1, 33, 0.5, 1e308, 10**400, float("nan"), True, None, "none", "33", "33 deg", "20 cm", "0,2 m", "20 kg", "",
    "x", "1 m" * 50, "9**9**9 m", [], [1.0], [None], {}, {"a": 1}, {"0": 1}, {1: 2}, b"x", {1.0}, object(), (1, 2), 1j,
    print,
)  # fmt: skip


def wild_changes(random):
    """Changes by dotted names, and what the right one of them has to give: (changes, (name, value))."""
    name, given, expected = random.choice(RIGHT)
    wild = {random.choice(DOTTED): random.choice(VALUES) for _ in range(random.choice((0, 0, 1, 1, 2)))}
    return {**wild, name: given}, (name, expected)


def _change(random, lines):
    at = random.randrange(len(lines))
    key = re.match(r"([\w]+) = (.*)", lines[at])
    kind = random.choice(
        ("scale", "scale", "nudge", "nudge", "nudge", "strange", "word", "drop", "twice", "name", "base")
    )
    if kind == "base":
        lines.insert(0, f"base = {random.choice(BASES)}")
    elif kind == "name":
        lines[:] = [f"name = {random.choice(NAMES)}" if line.startswith("name = ") else line for line in lines]
    elif kind == "drop":
        del lines[at]
    elif kind == "twice":
        lines.insert(random.randrange(len(lines)), lines[at])
    elif key is None:
        return
    elif kind == "word":
        name = key[1]
        cut = random.randrange(len(name))
        lines[at] = f"{random.choice((*WORDS, name[:cut] + name[cut + 1 :] or 'x'))} = {key[2]}"
    elif kind == "strange" or not re.fullmatch(r"-?\d{1,12}\.?\d{0,20}(e[-+]?\d{1,2})?", key[2]):
        lines[at] = f"{key[1]} = {random.choice(STRANGE)}"
    else:
        factor = random.choice((1e3, 1e-3, 1e6, 100.0, 0.01, math.pi / 180, -1.0, 1e12, 1e-12))
        value = float(key[2]) * (factor if kind == "scale" else random.uniform(0.7, 1.4))
        lines[at] = f"{key[1]} = {int(value) if '.' not in key[2] and 'e' not in key[2] else value!r}"


def _torn(random, text):
    at = random.randrange(len(text))
    return random.choice(
        (
            text[:at],
            text[:at] + random.choice("[]{}\"'=#.\\\x00\x7f\r\u2028") * random.choice((1, 3, 2000)) + text[at:],
            text[:at] + text[at + random.randrange(40) :],
            "".join(random.sample(text, len(text))),
            text + random.choice(("a = " + 3000 * "[", "a" + 3000 * ".a" + " = 1", "x = '''", "[gate]", "[[gate]]")),
        )
    )


def judged(load, origin, in_file):
    """What becomes of a scene: "planned", "warned" or "refused", else a fault.

    load : callable, returns the scene;  origin : str, what a refusal must name;  in_file : bool, whether a refusal must
    tell lines.

    Returns str, str: verdict, and what was said.

    Raises AssertionError, or whatever the program should not have raised.
    """
    begin = time.monotonic()
    try:
        scene = load()
        told = warnings_of(scene)
        data = rough_plan(scene, warn=lambda message: None)
    except (coupling.SceneError, Refused) as refusal:
        message = str(refusal)
        check_refusal(message, origin, in_file)
        verdict = "refused", message
    else:
        json.dumps(data, allow_nan=False)
        assert 0 < data["dt"] < 1e9 and data["points"] > 0, data
        folder = default_folder(scene.name)
        assert folder.parent.name == "runs" and folder.name not in (".", ".."), folder
        assert coupling.scenes.scene.parse_scene(scene.source, "again") == scene, "the stored text is another scene"
        assert len(told) == len(set(told))
        verdict = ("warned" if told else "planned"), "\n".join(told)
    assert time.monotonic() - begin < PATIENCE, "too slow"
    return verdict


def check_refusal(message, origin, in_file):
    """Rule, field, value and remedy, each mistake on a line, with the line of the file where one has to blame."""
    assert origin in message or "base" in message or "scene " in message, message
    assert len(message) < 20_000, message[:500]
    first, *mistakes = message.split("\n  ")
    if not mistakes:
        assert "got" in first or "must" in first, message
        assert ";" in first, message
        return
    count = re.search(r"has (\d+) mistake", first)
    assert count and int(count[1]) == len(mistakes), message
    for mistake in mistakes:
        where, _, rule = re.sub(r"^(\S+ )?line \d+: ", "", mistake).partition(": ")
        assert where and rule, mistake
        # a whole table that is missing has no line
        if in_file and not re.fullmatch(r"\w+: missing.*", mistake):
            assert re.match(r"(\S+ )?line \d+: ", mistake), mistake
        assert re.search("got|must|missing|unknown|outside|overlap|wider", rule), mistake
        assert ";" in rule or "missing" in rule, mistake
