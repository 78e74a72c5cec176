"""A figure that belongs to whoever gets it, and that a notebook shows once, as the last value of a cell."""

import io

from matplotlib.figure import Figure


class Picture(Figure):
    """A matplotlib figure outside of pyplot: nothing global knows it, so only Jupyter's display of a value shows it."""

    def _repr_png_(self):
        image = io.BytesIO()
        self.savefig(image, format="png")
        return image.getvalue()
