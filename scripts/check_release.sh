#!/usr/bin/env bash
# Wheel and sdist as a user gets them: built, and installed into an empty environment from wheels alone, without compilers.
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="$PWD/.uv/bin:$HOME/.local/bin:$PATH"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

uv build --quiet --out-dir "$work/dist" # the sdist, and the wheel from the sdist
wheel=("$work"/dist/*.whl)
sdist=("$work"/dist/*.tar.gz)

# What the program reads beside its modules is in both.
python="$(uv python find)"
"$python" -m zipfile --list "${wheel[0]}" | awk 'NR > 1 {print $1}' | sort >"$work/in-wheel"
tar --list --file "${sdist[0]}" | sed 's|^[^/]*/||' | sort >"$work/in-sdist"
find mpm structure coupling verification -type f ! -name '*.pyc' | sort >"$work/needed"
for list in in-wheel in-sdist; do
    if ! comm -23 "$work/needed" "$work/$list" >"$work/missing" || [ -s "$work/missing" ]; then
        echo "not in the ${list#in-}:" && cat "$work/missing" && exit 1
    fi
done
for name in LICENSE CITATION.cff CONTRIBUTING.md CHANGELOG.md README.md; do
    grep -qx "$name" "$work/in-sdist" || { echo "not in the sdist: $name"; exit 1; }
done

# No compilers: nothing may be built, and none is on the path of what runs.
uv venv --quiet --python "$python" "$work/venv"
uv pip install --quiet --python "$work/venv" --only-binary :all: "${wheel[0]}"
cd "$work"
run=(env -i HOME="$work" PATH="$work/venv/bin" LANG=C.UTF-8)
"${run[@]}" gush --version
"${run[@]}" python -W error -c "import mpm, structure, coupling, verification.commands"
"${run[@]}" gush scenes >/dev/null
"${run[@]}" gush accuracy --help >/dev/null # a command that joins
"${run[@]}" python -W error - <<'EOF'
from importlib import resources

import coupling
import structure
from coupling.studies.cases import cases
from coupling.studies.design import load_study, study_names

assert {"quick", "case-3", "twin-tunnels"} <= set(coupling.scene_names())
assert all(cases(load_study(name)) for name in study_names()) and study_names()
report = resources.files("coupling") / "report" / "templates"
assert {"page.html", "page.css", "charts.js", "library"} <= {entry.name for entry in report.iterdir()}
loads = structure.theoretical_pressures(
    outer_diameter=6.6, cover=20.0, buoyant_unit_weight=8.9e3, coefficient_at_rest=0.577
)
response = structure.BeamSpringLining(coupling.load_scene("quick").ring).respond(loads)
# round-off of the balance of forces, over the loads
assert response.equilibrium_residual.item() < 1e-8
EOF
echo "release: wheel and sdist are complete and install without compilers"
