"""Parameters that are given, not estimated: checks, and values by model."""

from collections.abc import Mapping, Sequence

import numpy as np

from shiplog.errors import UsageError
from shiplog.ships import Model
from shiplog.vessel.vessel import Vessel

from .advice import RUDDER_PARAMETERS


def check_fixed(models: Sequence[Model], fixed: Mapping[str, float]) -> None:
    """Check that fixed parameters exist, lie within their limits and leave something to estimate.

    Parameters
    ----------
    models
        All models that are to be fitted with them.
    fixed
        Values by parameter name, each in the parameter's own unit.

    Raises
    ------
    UsageError
        No model has a parameter of that name; models have it in different units; a value is not
        finite or outside the limits; or no parameter is free.
    """
    for model in models:
        if all(parameter.fixed or parameter.name in fixed for parameter in model.parameters):
            raise UsageError(
                f"all parameters of the model {model.name} are fixed and none is "
                "estimated; fix fewer"
            )
    for name, value in fixed.items():
        having = [model.parameter(name) for model in models if name in model.names]
        if not having:
            models[0].parameter(name)  # raises, and lists the names there are
        units = sorted({parameter.unit for parameter in having})
        if len(units) > 1:
            raise UsageError(
                f"fixed parameter {name} is in {' or '.join(units)}, depending on the model; "
                "name the model"
            )
        lowest = max(parameter.lowest for parameter in having)
        highest = min(parameter.highest for parameter in having)
        if not (np.isfinite(value) and lowest <= value <= highest):
            raise UsageError(
                f"fixed parameter {name} must be a finite number from {lowest:g} to {highest:g}, "
                f"got {value:g}"
            )


def fixed_values(
    model: Model, fixed: Mapping[str, float], vessel: Vessel | None
) -> dict[str, float]:
    """Return the fixed parameters of one model: those given, and the alphas of the vessel file.

    Parameters
    ----------
    model
        The model; parameters that it does not have are omitted.
    fixed
        Values given by the caller; they override the vessel file.
    vessel
        The vessel file, if any.
    """
    values: dict[str, float] = {}
    if vessel is not None and vessel.coefficients is not None:
        names = [name for name in RUDDER_PARAMETERS if name in model.names]
        values = {name: getattr(vessel.coefficients, name) for name in names}
    return values | {name: fixed[name] for name in model.names if name in fixed}
