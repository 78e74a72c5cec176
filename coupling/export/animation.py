"""Fields around the tunnel as an animation, one picture a snapshot."""

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from coupling.datasets.geometry import has_tunnels
from coupling.figures.ground import FIELD_COLOURS, common_tops, fields_around_tunnel
from coupling.refused import Refused

SECONDS_OF_ANIMATION, LONGEST_FRAME, LAST_FRAME = 6.0, 0.5, 1.5


def animation(points, path, mesh=None):
    """Fields around the tunnel, one picture a snapshot, colours the same at all times."""
    if not has_tunnels(points):
        raise Refused("export: an animation shows the surroundings of a tunnel, the scene has none; take vtu")
    tops, pictures = common_tops(points), []
    for k in range(points.sizes["time"]):
        canvas = FigureCanvasAgg(fields_around_tunnel(points.isel(time=k), tops=tops, mesh=mesh))
        canvas.draw()
        pictures.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
    frame = int(1000 * min(LONGEST_FRAME, SECONDS_OF_ANIMATION / len(pictures)))
    lasting = [frame] * (len(pictures) - 1) + [int(1000 * LAST_FRAME)]
    palette = _palette()
    drawn = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    drawn[0].save(path, save_all=True, append_images=drawn[1:], duration=lasting, loop=0)
    return path


def _palette():
    """The 256 colours that a GIF may have, the same for all pictures: even samples of the colour maps, and greys."""
    greys = 24
    each = (256 - greys) // len(FIELD_COLOURS)
    maps = [matplotlib.colormaps[name](np.linspace(0, 1, each), bytes=True)[:, :3] for name in FIELD_COLOURS]
    grey = np.repeat(np.linspace(0, 255, greys).astype("u1")[:, None], 3, axis=1)
    image = Image.new("P", (1, 1))
    image.putpalette(np.concatenate([*maps, grey]).tobytes())
    return image
