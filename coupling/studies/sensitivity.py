"""Which parameter of a study moves a quantity: rank correlations and main effects, and their pictures."""

from __future__ import annotations

import numpy as np


def sensitivity(study, quantity):
    """Rank correlation and main effect of every numeric parameter.

    Parameters
    ----------
    study : xarray.Dataset
        Of :func:`coupling.study`.
    quantity : xarray.DataArray
        (case), for instance ``study.bending_moment.sel(model="beam-spring").isel(progress=-1).max("theta_ring")``.

    Returns
    -------
    xarray.Dataset
        Over `parameter`, largest effect first: rank_correlation [-] (Spearman) and p_value [-]; low, high: means of the
        quantity over the cases with the lower and upper half of the parameter's values, in the quantity's unit; effect:
        high - low.

    Raises
    ------
    ValueError
        Fewer than three finished cases, or no parameter with two different numbers.
    """
    import xarray as xr
    from scipy.stats import spearmanr

    values = np.asarray(quantity.values, float)
    if quantity.dims != ("case",):
        raise ValueError(f"quantity: must have the dimension (case,), got {quantity.dims}; select a state and a place")
    known = np.isfinite(values)
    if known.sum() < 3:
        raise ValueError(f"quantity: must be known in at least 3 cases, got {known.sum()}; run more cases")
    rows = {}
    for name, coordinate in study.coords.items():
        if coordinate.dims != ("case",) or name == "case" or coordinate.dtype.kind not in "fiu":
            continue
        parameter = coordinate.values.astype(float)
        if len(np.unique(parameter[known])) < 2:
            continue
        test = spearmanr(parameter[known], values[known])
        middle = np.median(parameter[known])
        lower, upper = known & (parameter < middle), known & (parameter > middle)
        if not lower.any() or not upper.any():
            lower, upper = known & (parameter <= middle), known & (parameter >= middle)
        low, high = values[lower].mean(), values[upper].mean()
        rows[str(name)] = (float(test.statistic), float(test.pvalue), low, high, high - low)
    if not rows:
        raise ValueError("study: must vary at least one number, got none; add a list or a range to [parameters]")
    order = sorted(rows, key=lambda name: -abs(rows[name][4]))
    units = quantity.attrs.get("units", "")
    columns = zip(*(rows[name] for name in order), strict=True)
    about = (
        ("rank_correlation", "1", "Spearman's rank correlation"),
        ("p_value", "1", "probability of such a correlation by chance"),
        ("low", units, "mean over the lower half of the parameter's values"),
        ("high", units, "mean over the upper half of the parameter's values"),
        ("effect", units, "high less low"),
    )
    return xr.Dataset(
        {
            name: ("parameter", np.array(column), {"units": unit, "long_name": text})
            for (name, unit, text), column in zip(about, columns, strict=True)
        },
        coords={"parameter": order},
        attrs={"quantity": str(quantity.attrs.get("long_name", quantity.name))},
    )


def tornado(result, label: str = "", scale: float = 1.0):
    """Bars from the low to the high mean of every parameter, the largest on top.

    Parameters
    ----------
    result : xarray.Dataset
        Of :func:`sensitivity`.
    label : str
        Of the axis, with its unit.
    scale : float
        Factor from the dataset's unit to that of the label.

    Returns
    -------
    matplotlib.figure.Figure
    """
    import matplotlib

    from coupling.figures import STYLE
    from coupling.picture import Picture

    with matplotlib.rc_context(STYLE):
        names = result["parameter"].values[::-1]
        figure = Picture(figsize=(5.6, 1.0 + 0.32 * len(names)), layout="constrained")
        axes = figure.subplots()
        low, high = scale * result["low"].values[::-1], scale * result["high"].values[::-1]
        place = np.arange(len(names))
        axes.barh(place, high - low, left=low, height=0.6, color="#9dbbd8")
        axes.plot(low, place, "o", ms=4, color="#0b5394", label="lower half of the values")
        axes.plot(high, place, "o", ms=4, color="#c1272d", label="upper half")
        axes.set_yticks(place, names)
        axes.set_xlabel(label or f"{result.attrs['quantity']} [{result['low'].attrs['units']}]")
        axes.grid(True, axis="x")
        figure.legend(loc="outside upper center", ncols=2, fontsize=7)
    return figure


def scatter(study, quantity, label: str = "", scale: float = 1.0):
    """The quantity over every numeric parameter, one panel each.

    Parameters
    ----------
    study : xarray.Dataset
    quantity : xarray.DataArray
        (case)
    label, scale
        As for :func:`tornado`.

    Returns
    -------
    matplotlib.figure.Figure
    """
    import matplotlib

    from coupling.figures import STYLE
    from coupling.picture import Picture

    names = [str(name) for name in sensitivity(study, quantity)["parameter"].values]
    with matplotlib.rc_context(STYLE):
        figure = Picture(figsize=(min(2.4 * len(names) + 0.6, 10), 2.6), layout="constrained")
        panels = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
        for axes, name in zip(panels, names, strict=True):
            axes.plot(study[name].values, scale * quantity.values, "o", ms=4, color="#0b5394")
            axes.set_xlabel(name)
            axes.grid(True)
            values = study[name].values
            if values.min() > 0 and values.max() / values.min() > 30:
                axes.set_xscale("log")
        panels[0].set_ylabel(
            label or f"{quantity.attrs.get('long_name', quantity.name)} [{quantity.attrs.get('units')}]"
        )
    return figure
