"""Tables that several commands show."""

from rich.table import Table


def response_table(data, tunnel=None):
    table = Table("ring" if tunnel is None else f"ring of tunnel {tunnel}", "initial", "final")
    for name, label, unit in (
        ("axial_force", "N", "kN/m"),
        ("shear_force", "Q", "kN/m"),
        ("bending_moment", "M", "kN m/m"),
    ):
        for extreme in ("max", "min"):
            table.add_row(
                f"{label} {extreme} [{unit}]".replace("[", "\\["),
                *(
                    f"{data[name][state][extreme] / 1e3:.0f} at {data[name][state][extreme + '_theta'] % 360:.4g} deg"
                    for state in ("initial", "final")
                ),
            )
    for name, label in (
        ("joint_opening", "joint opening (+) or closing (-) [mm]"),
        ("joint_rotation", "joint rotation [mrad]"),
    ):
        if data[name]["final"]:
            cells = (" ".join(f"{1e3 * value:.2f}" for value in data[name][state]) for state in ("initial", "final"))
            table.add_row(label.replace("[", "\\["), *cells)
    return table
