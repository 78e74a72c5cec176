"""The command `gush respond`."""

from pathlib import Path
from typing import Annotated

import typer

from coupling.commands.exit_codes import JsonPath, answering, say
from coupling.commands.options import SOURCE, RingScene
from coupling.commands.tables import print_ring


def draw_checks(checked, file, model, own_file=None, tunnel=None):
    """Draw the checks beside a run's figures, or beside the response's own file and named after it; returns the path.

    file : of the run;  own_file : from :func:`coupling.responses.respond.chosen_file`;  tunnel : without the gate.
    """
    from coupling.figures import RESOLUTION
    from coupling.figures.utilisations import checks
    from coupling.files.folder import FIGURES

    folder = file.parent / FIGURES
    path = (folder if folder.is_dir() else file.parent) / (
        f"checks-{model}{'' if tunnel is None else f'-tunnel-{tunnel}'}.png"
    )
    if own_file is not None:
        path = own_file.with_name(f"{own_file.stem}-checks.png")
    checks(checked).savefig(path, dpi=RESOLUTION)
    return str(path)


def respond_command(
    run: Annotated[Path, typer.Argument(help=SOURCE)],
    backend: Annotated[
        str, typer.Option(help="Lining model: beam-spring, continuum, an installed one, or yours as FILE.py:CLASS.")
    ] = "beam-spring",
    scene: RingScene = None,
    limits: Annotated[
        Path | None, typer.Option(help="TOML file of structure.Limits in place of the [limits] of the scene.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File for the response; when left out RUN itself, beside it where RUN is none.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file of an earlier response.")] = False,
    json_path: JsonPath = None,
):
    """Compute the ring's response to the pressures of a run, and store it with them as /structure/BACKEND.

    The response of another ring (--scene), or to pressures that are no run, goes into a file of its own beside them:
    FILE-BACKEND.nc.

    JSON: keys of `coupling.postprocess.summary.summarise_response`, and `run`, `backend`, `file` (path of the
    response); with limits `figure` (path). Of several
    tunnels these are of that with the gate, `tunnels` has the same of the others.
    """
    with answering(json_path) as answer:
        from coupling.postprocess.summary import summarise_response
        from coupling.responses import respond as responses
        from coupling.responses.source import read_sources

        sources = read_sources(run, scene)
        given = None if limits is None else responses.read_limits(limits)
        name = backend.rpartition(":")[2]
        targets = [responses.chosen_file(source, name, out, overwrite) for source in sources]
        answers = []
        for source, target in zip(sources, targets, strict=True):
            response = responses.respond_by_name(source.ring, source.pressures, backend, source.moved)
            response = responses.with_checks(response, source.limits(given))
            found = summarise_response(response)
            found["file"] = str(responses.store_response(response, source, name, target))
            if found["utilisations"]:
                found["figure"] = draw_checks(response, source.file, name, target, source.tunnel)
            answers.append(found)
        data = {"run": str(run), "backend": name, **answers[0]}
        if len(sources) > 1:
            data["tunnels"] = {source.tunnel: found for source, found in zip(sources[1:], answers[1:], strict=True)}
        if answer(data):
            for source, found in zip(sources, answers, strict=True):
                print_ring(found, source.tunnel)
                if found["utilisations"]:
                    say(f"picture in {found['figure']}")
                say(f"response in {found['file']}")
