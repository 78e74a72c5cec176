"""The command `gush scenes`."""

from rich.console import Console

from coupling.commands.exit_codes import JsonPath, answering
from coupling.commands.tables import table


def scenes_command(json_path: JsonPath = None):
    """List the built-in scenes.

    JSON: `scenes`, a list of {name, soil, cover [m], gate_angle [degree], gate_width [m], tunnels, stop_time [s],
    stop_inflow_mass [kg/m]}.
    """
    with answering(json_path) as answer:
        from coupling.scenes.layers import scene_names
        from coupling.scenes.scene import load_scene

        data = {"scenes": [_scene_row(load_scene(name)) for name in scene_names()]}
        if answer(data):
            heads = ("scene", "soil", "cover", "gate", "tunnels", "until")
            Console().print(table(heads, map(_cells, data["scenes"])))


def _cells(row):
    gate = "none" if row["gate_angle"] is None else f"{row['gate_angle']:g}°, {row['gate_width']:g} m"
    until = [f"{row['stop_inflow_mass']:g} kg/m"] if row["stop_inflow_mass"] else []
    until += [f"{row['stop_time']:g} s"] if row["stop_time"] else []
    return row["name"], row["soil"], f"{row['cover']:g} m", gate, str(row["tunnels"]), ", ".join(until)


def _scene_row(scene):
    gate = scene.gate
    return {
        "name": scene.name,
        "soil": ", ".join(soil.name for soil in scene.soils),
        "cover": scene.tunnels[0].cover if scene.tunnels else None,
        "gate_angle": None if gate is None else gate.angle,
        "gate_width": None if gate is None else gate.width,
        "tunnels": len(scene.tunnels),
        "stop_time": scene.stop.time,
        "stop_inflow_mass": scene.stop.inflow_mass,
    }
