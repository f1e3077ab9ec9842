"""The mock's telemetry of motion: the magnetic field against SciPy, the terrain's altitude."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_rig import Rig
from scipy.spatial.transform import Rotation

from sitl_mock.ardupilot.motion_telemetry import ArduPilotMotionTelemetry
from sitl_mock.autopilot.motion_telemetry import MotionTelemetry
from sitl_mock.autopilot.stamp_slips import StampSlips
from sitl_mock.physics.geodesy import Geodetic

FIELD_NED = (0.21, 0.01, 0.42)
STATE = SimpleNamespace(
    stamp_us=0,
    estimate=SimpleNamespace(
        specific_force_frd=(0.0, 0.0, -9.8),
        body_rates=(0.0, 0.0, 0.0),
        position_ned=(0.0, 0.0, 0.0),
    ),
)
angle = st.floats(-3.1, 3.1)


@settings(derandomize=True)
@given(angle, st.floats(-1.5, 1.5), angle)
def test_the_magnetic_field_is_in_the_body_frame(roll, pitch, heading):
    attitude = Rotation.from_euler("ZYX", (heading, pitch, roll))
    x, y, z, w = attitude.as_quat()
    vehicle = SimpleNamespace(truth=SimpleNamespace(q=(w, x, y, z)))
    of_vehicle = STATE, vehicle, Geodetic(47.0, 8.0, 489.4), StampSlips(0.0, 1)
    px4, ardupilot = MotionTelemetry(*of_vehicle), ArduPilotMotionTelemetry(*of_vehicle)
    gauss = attitude.inv().apply(FIELD_NED)
    for message, factor, rounding in (
        (px4.highres_imu(), 1.0, 1e-9),
        (ardupilot.highres_imu(), 1e6, 1e-3),
        (ardupilot.raw_imu(), 1e3, 0.51),
    ):
        field = (message.xmag, message.ymag, message.zmag)
        np.testing.assert_allclose(field, factor * gauss, rtol=0.0, atol=rounding)


def test_the_altitude_of_the_terrain_has_the_error_of_the_estimated_height():
    rig = Rig(
        sensors={"ekf": {"height_offset_m": 0.5, "height_noise_m": 0.0, "sink_noise_m_s": 0.0}}
    )
    rig.take_off(4.0)
    rig.run(3.0)
    altitude, height = rig.messages("ALTITUDE")[-1], -rig.truth.position_ned[2]
    assert altitude.bottom_clearance == pytest.approx(height, abs=0.05)
    assert altitude.altitude_terrain == pytest.approx(-0.5, abs=0.15)
    assert altitude.altitude_local == pytest.approx(height - 0.5, abs=0.15)
