"""The prediction models by name: what the controller believes of the vehicle's motion.

The equation numbers are those of Xu & Pei, Sensors 2026, 26(9), 2727, whose three models are
`proposed` (34), `euler` (37) and `quaternion` (39). None of those limits tilt or rates. `limited`
is ours, and `euler-reduced` the fair baseline of `euler`. Drag and a disturbance are the same in
all of them: the paper leaves them out.
"""

from collections.abc import Callable

from companion.nmpc.attitude_models import euler, euler_reduced, quaternion
from companion.nmpc.coefficient_models import limited, proposed
from companion.nmpc.model import Model
from companion.nmpc.settings import ModelName, Settings

_MODELS: dict[ModelName, Callable[[Settings], Model]] = {
    "proposed": proposed,
    "limited": limited,
    "euler": euler,
    "euler-reduced": euler_reduced,
    "quaternion": quaternion,
}

MODEL_NAMES = tuple(_MODELS)


def make_model(settings: Settings) -> Model:
    """The model that the settings name.

    Raises:
        ValueError: there is none of that name.
    """
    if settings.model not in _MODELS:
        raise ValueError(f"unknown model {settings.model!r}; known: {', '.join(_MODELS)}")
    return _MODELS[settings.model](settings)
