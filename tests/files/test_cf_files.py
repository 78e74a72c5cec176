"""Every dataset opens with plain xarray, follows the CF conventions, and notices when a bit of it was changed."""

import hashlib
import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import coupling
import mpm
from coupling import datasets
from coupling.files.provenance import PACKAGES
from coupling.responses import comparison as compare
from coupling.responses.source import read_source
from verification.synthetic_run import make_quick_scene, write_run

GROUPS = ("lining", "history", "points", "mesh", "structure/beam_spring", "structure/continuum")
#: Elapsed time in plain "s" is right for a duration; CF's rules for time coordinates know calendar times only.
KNOWN = {"Coordinate variable 'time' should have standard_name='time', found: 'None'"}
#: CF 1.11 takes over the roles of UGRID 1.0, which the checker does not know yet.
KNOWN |= {
    f"{role} is not a valid cf_role value. It must be one of timeseries_id, profile_id, trajectory_id"
    for role in ("mesh_topology", "face_node_connectivity")
} | {
    "There may only be one variable containing the cf_role attribute. Currently the following variables have cf_role "
    "attributes: ['topology', 'element_nodes']"
}
# in a process of its own: the checker brings a second HDF5 library
CHECK = """
import json, sys, warnings
warnings.simplefilter("ignore")
from compliance_checker.runner import CheckSuite
suite = CheckSuite()
suite.load_all_available_checkers()
found = {}
for path in sys.argv[1:]:
    results, errors = suite.run_all(suite.load_dataset(path), ["cf:1.11"])["cf:1.11"]
    found[path] = [m for r in results if r.value[0] < r.value[1] for m in r.msgs] + [str(e) for e in errors.values()]
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("cf") / "run.nc")


def flat(file, group, path):
    """Copy one group with the attributes of the root, as a reader of it has them: the checker knows no groups."""
    with xr.open_dataset(file, group=group, decode_cf=False) as data, xr.open_dataset(file) as root:
        data.attrs = {**root.attrs, **data.attrs}
        for variable in data.variables.values():
            variable.encoding = {} if "_FillValue" in variable.attrs else {"_FillValue": None}
        data.to_netcdf(path, engine="h5netcdf")
    return path


NO_CHECKER = importlib.util.find_spec("compliance_checker") is None


@pytest.mark.skipif(NO_CHECKER, reason="needs the package compliance-checker")
@pytest.mark.slow
def test_every_dataset_passes_the_cf_check(run, tmp_path):
    paths = [flat(run, group, tmp_path / f"{group.replace('/', '-')}.nc") for group in GROUPS]
    source = read_source(run)
    differences = compare.compare(source, "beam-spring", "continuum").differences
    paths.append(tmp_path / "differences.nc")
    datasets.write_dataset(paths[-1], differences)
    done = subprocess.run([sys.executable, "-c", CHECK, *map(str, paths)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert len(found) == len(paths)
    assert {path: set(messages) - KNOWN for path, messages in found.items()} == {path: set() for path in found}


def test_every_group_opens_with_plain_xarray(run):
    # as a user types it: no engine, no options; warnings are errors in these tests
    for group in GROUPS:
        with xr.open_dataset(run, group=group, decode_timedelta=False) as data:
            assert data.sizes and all(data[name].attrs.get("units") for name in data.data_vars if name != "topology")
    assert xr.open_dataset(run, group="lining", decode_timedelta=False)["soil_pressure"].sizes["time"] == 5


def test_everything_to_repeat_a_run_is_inside(run, tmp_path):
    attributes = datasets.read_attributes(run)
    (tmp_path / "again.toml").write_text(attributes["scene"])
    assert coupling.load_scene(tmp_path / "again.toml") == make_quick_scene()
    for name in ("source", "revision", "solver_sha256", "python", "processor", "created", "random_numbers"):
        assert isinstance(attributes[name], str)
    sources = Path(mpm.__file__).parent
    digest = hashlib.sha256()
    for file in sorted(sources.rglob("*.py")):
        digest.update(f"{file.relative_to(sources).as_posix()} {file.stat().st_size}\n".encode() + file.read_bytes())
    assert attributes["solver_sha256"] == digest.hexdigest() != hashlib.sha256().hexdigest()
    if (sources.parent / ".git").exists():  # not where it is installed
        head = subprocess.run(
            ["git", "rev-parse", "HEAD"], cwd=sources.parent, capture_output=True, text=True, check=True
        )
        assert head.stdout.startswith(attributes["revision"].removesuffix("+changed")) and attributes["revision"]
    assert [entry.split(" ")[0] for entry in attributes["versions"].split(", ")] == list(PACKAGES)
    assert attributes["history"].splitlines()[-1].endswith("/structure/continuum computed")


def changed_bit(run, path, name):
    """A copy of a run file in which one bit of the stored values of a variable is flipped."""
    import h5py

    with h5py.File(run, "r") as file:
        dataset = file[name]
        chunk = dataset.id.get_chunk_info(0)
        assert dataset.fletcher32
    content = bytearray(run.read_bytes())
    content[chunk.byte_offset + chunk.size // 3] ^= 0x08
    path.write_bytes(content)
    return path


@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("lining/soil_pressure", datasets.read_pressures),
        ("lining/theta_bnds", datasets.read_pressures),
        ("history/inflow_mass", datasets.read_history),
        ("points/x", datasets.read_points),
        ("mesh/element_nodes", datasets.read_mesh),
        ("structure/continuum/bending_moment", lambda path: datasets.read_response(path, "continuum")),
    ],
)
def test_a_flipped_bit_in_the_values_is_noticed(run, tmp_path, name, read):
    assert np.all([np.size(values) for values in read(run).data_vars.values()])
    with pytest.raises(datasets.RunFileError, match="damaged"):
        read(changed_bit(run, tmp_path / "run.nc", name))


def test_a_changed_scene_text_is_noticed(run, tmp_path):
    content = run.read_bytes()
    assert content.count(b"youngs_modulus = 40000000.0") >= 1
    (tmp_path / "run.nc").write_bytes(content.replace(b"youngs_modulus = 40000000.0", b"youngs_modulus = 70000000.0"))
    with pytest.raises(datasets.RunFileError, match="scene"):
        datasets.read_attributes(tmp_path / "run.nc")
