"""Which parameter of a study moves a quantity: rank correlations and main effects, and their pictures.

Samples and correlations are scipy's (`scipy.stats.qmc`, `spearmanr`). The effects are our own, since they are to come
out of the cases that there are: `scipy.stats.sobol_indices`, and SALib's Sobol and Morris, ask for samples of their
own, n (d + 2) and n (d + 1) cases of d parameters with n up to hundreds, and know neither texts nor listed values
nor the base of a one-at-a-time study. Of a linear function the squares of the effects are in the ratio of its Sobol
indices.
"""

import json

import numpy as np
import xarray as xr
from scipy.stats import spearmanr

from coupling.figures.picture import styled
from coupling.studies.design import AS_IT_IS

#: Fewest values of which a rank correlation says anything.
FEWEST_RANKED = 3


def sensitivity(study, quantity):
    """How far every parameter moves a quantity.

    In a "one-at-a-time" study every case but the first, the base, changes one parameter: what a parameter does is the
    difference between its own cases and the base, and nothing else counts for it. In all other designs every parameter
    has different values in many cases: its effect is the difference between means over the cases.

    Parameters
    ----------
    study : xarray.Dataset
        Of :func:`coupling.study`.
    quantity : xarray.DataArray
        (case), for instance ``study.bending_moment.sel(model="beam-spring").isel(progress=-1).max("theta")``.

    Returns
    -------
    xarray.Dataset
        Over `parameter`, largest effect first; in the quantity's unit: low, high and effect = high - low.
        "one-at-a-time": low, high are the quantity at the smallest and at the largest value of the parameter, the
        base's value among them; `base` is the quantity there. Other designs: means over the cases with the lower and
        the upper half of the parameter's different values, a middle one left out. Of a parameter of texts or truth
        values low and high are the smallest and the largest of the quantity, in other designs of its mean by value.
        rank_correlation [-] (Spearman) and p_value [-] over the same cases; NaN for texts and with fewer than three
        values.

    Raises
    ------
    ValueError
        Fewer than three finished cases, no parameter with two different values, or a one-at-a-time study without
        its base.
    """
    values = np.asarray(quantity.values, float)
    if quantity.dims != ("case",):
        raise ValueError(f"quantity: must have the dimension (case,), got {quantity.dims}; select a state and a place")
    known = np.isfinite(values)
    if known.sum() < 3:
        raise ValueError(f"quantity: must be known in at least 3 cases, got {known.sum()}; run more cases")
    parameters = parameters_of(study)
    alone = json.loads(study.attrs.get("study", "{}")).get("design") == "one-at-a-time"
    base = _base(study, known) if alone else None
    rows = {}
    for name, parameter in parameters.items():
        own = known & _own_cases(parameters, name, base) if alone else known
        own = own & (parameter == parameter)  # cases without a number, nan, say nothing of it
        if len(set(parameter[own].tolist())) > 1:
            rows[name] = _effect(parameter[own], values[own], alone)
    if not rows:
        raise ValueError("study: must vary at least one parameter, got none; add a list or a range to [parameters]")
    order = sorted(rows, key=lambda name: -abs(rows[name][3] - rows[name][2]))
    units = quantity.attrs.get("units", "")
    low, high = (
        ("at the smallest value", "at the largest value")
        if alone
        else ("mean of the lower half of the values", "mean of the upper half")
    )
    about = (
        ("rank_correlation", "1", "Spearman's rank correlation"),
        ("p_value", "1", "probability of such a correlation by chance"),
        ("low", units, low),
        ("high", units, high),
    )
    columns = zip(*(rows[name] for name in order), strict=True)
    result = xr.Dataset(
        {
            name: ("parameter", np.array(column), {"units": unit, "long_name": text})
            for (name, unit, text), column in zip(about, columns, strict=True)
        },
        coords={"parameter": order},
        attrs={"quantity": str(quantity.attrs.get("long_name", quantity.name))},
    )
    result["effect"] = (result["high"] - result["low"]).assign_attrs(units=units, long_name="high less low")
    if alone:
        result["base"] = ((), values[base], {"units": units, "long_name": "of the scene as it is"})
    return result


def parameters_of(study):
    """Parameters of a study that differ between its cases: name to values (case), numbers as float64, texts as str."""
    found = {}
    for name, coordinate in study.coords.items():
        if coordinate.dims != ("case",) or name in ("case", "case_name"):
            continue
        numeric = coordinate.dtype.kind in "fiu"
        values = coordinate.values.astype(float if numeric else str)
        if len(set(values.tolist())) > 1:
            found[str(name)] = values
    return found


def _base(study, known):
    """Place of the case that changes nothing."""
    names = study["case_name"].values.tolist() if "case_name" in study.coords else []
    base = names.index(AS_IT_IS) if AS_IT_IS in names else int(np.argmin(study["case"].values))
    if not known[base] or (not names and int(study["case"][base]) != 0):
        raise ValueError(
            "study: a one-at-a-time design must have its base, the scene as it is, among the finished cases, got none; "
            "run that case"
        )
    return base


def _own_cases(parameters, name, base):
    """Cases that leave all other parameters as the base has them."""
    others = [
        (values == values[base]) | ((values != values) & (values[base] != values[base]))  # what has no number is nan
        for other, values in parameters.items()
        if other != name
    ]
    return np.logical_and.reduce(others) if others else np.ones(len(parameters[name]), bool)


def _effect(parameter, values, alone):
    """Rank correlation, its p-value, low and high of :func:`sensitivity`, over the cases of one parameter."""
    different = np.unique(parameter)
    if parameter.dtype.kind != "f":
        means = [values[parameter == each].mean() for each in different]
        return np.nan, np.nan, min(means), max(means)
    half = 1 if alone else len(different) // 2
    low = values[parameter <= different[half - 1]].mean()
    high = values[parameter >= different[-half]].mean()
    ranked = len(different) >= FEWEST_RANKED or (not alone and len(values) >= FEWEST_RANKED)
    test = spearmanr(parameter, values) if ranked else None
    return (np.nan, np.nan, low, high) if test is None else (float(test.statistic), float(test.pvalue), low, high)


def tornado(result, label: str = "", scale: float = 1.0):
    """Bars from low to high of every parameter, the largest on top; a line at the base of a one-at-a-time study.

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
    names = result["parameter"].values[::-1]
    with styled(5.6, 1.0 + 0.32 * len(names)) as figure:
        axes = figure.subplots()
        low, high = scale * result["low"].values[::-1], scale * result["high"].values[::-1]
        place = np.arange(len(names))
        axes.barh(place, high - low, left=low, height=0.6, color="#9dbbd8")
        axes.plot(low, place, "o", ms=4, color="#0b5394", label=result["low"].attrs["long_name"])
        axes.plot(high, place, "o", ms=4, color="#c1272d", label=result["high"].attrs["long_name"])
        if "base" in result:
            axes.axvline(scale * float(result["base"]), color="0.3", lw=0.8, label=result["base"].attrs["long_name"])
        axes.set_yticks(place, names)
        axes.set_xlabel(label or f"{result.attrs['quantity']} [{result['low'].attrs['units']}]")
        axes.grid(True, axis="x")
        figure.legend(loc="outside upper center", ncols=2, fontsize=7)
    return figure


def scatter(study, quantity, label: str = "", scale: float = 1.0):
    """The quantity over every parameter, one panel each.

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
    names = [str(name) for name in sensitivity(study, quantity)["parameter"].values]
    parameters = parameters_of(study)
    with styled(min(2.4 * len(names) + 0.6, 10), 2.6) as figure:
        panels = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
        for axes, name in zip(panels, names, strict=True):
            values = parameters[name]
            axes.plot(values, scale * quantity.values, "o", ms=4, color="#0b5394")
            unit = study[name].attrs.get("units", "1")
            axes.set_xlabel(name if unit == "1" else f"{name} [{unit}]")
            axes.grid(True)
            if values.dtype.kind == "f" and values.min() > 0 and values.max() / values.min() > 30:
                axes.set_xscale("log")
        panels[0].set_ylabel(
            label or f"{quantity.attrs.get('long_name', quantity.name)} [{quantity.attrs.get('units')}]"
        )
    return figure
