"""PX4's pilot and ground station: their sticks, their loss, and what parameters make of it."""

import pytest
from mock_rig import ACCEPTED, QUICK, TEMPORARILY_REJECTED, Rig
from pymavlink.dialects.v20 import development as dialect

HOLD = "Failsafe activated, entering Hold for 2 seconds\t"


class Piloted(Rig):
    """A rig with somebody at the sticks, until ``sticks`` is None."""

    def __init__(self):
        super().__init__(boot=False, prearm_delay_s=0.2)
        self.sticks = (0, 0, 0)
        self.setpoint = None
        self.each_tick = self._speak
        self.heartbeat()
        self.run(0.4)

    def _speak(self):
        if self.sticks is not None:
            x, y, r = self.sticks
            self.say(dialect.MAVLink_manual_control_message(1, x, y, 500, r, 0))
        if self.setpoint is not None:
            self.rates(**self.setpoint)

    def set(self, **parameters):
        for name, value in parameters.items():
            self.simulation.parameters.set(name, value)


@pytest.fixture(scope="module")
def flying():
    rig = Piloted()
    rig.set(**QUICK)
    rig.take_off(9.0)
    rig.defaults = {name: rig.simulation.parameters[name] for name in rig.simulation.parameters}
    return rig


@pytest.fixture
def rig(flying):
    """In OFFBOARD with a pilot at rest; what went before is undone, but for where it is."""
    flying.set(**flying.defaults)
    flying.sticks, flying.setpoint = (0, 0, 0), {}
    flying.run(0.6)  # the sticks come to rest
    assert flying.mode(4, 3) == ACCEPTED
    assert flying.offboard() == ACCEPTED
    flying.run(0.1)
    assert mode(flying) == "OFFBOARD"
    assert not flying.state.failsafe
    flying.forget()
    return flying


def mode(rig):
    return rig.state.mode.name


def test_sticks_at_rest_change_nothing_and_moved_ones_take_over(rig):
    rig.run(1.0)
    assert mode(rig) == "OFFBOARD"
    rig.sticks = (0, 250, 0)
    rig.run(0.1)
    assert mode(rig) == "POSCTL"
    assert "Pilot took over using sticks\t" in rig.texts()
    rig.run(1.0)
    assert mode(rig) == "POSCTL", "the stream goes on, and is not obeyed"


def test_slow_sticks_do_not_take_over(rig):
    for step in range(200):
        rig.sticks = (4 * step // 2, 0, 0)  # 0.5 of a half travel a second
        rig.run(0.004)
    assert mode(rig) == "OFFBOARD"


def test_a_negative_speed_switches_the_override_off(rig):
    rig.set(MAN_OVERRIDE_SPD=-1.0)
    rig.sticks = (0, 900, 0)
    rig.run(0.5)
    assert mode(rig) == "OFFBOARD"


@pytest.mark.parametrize(
    ("action", "modes"),
    [(0, ("OFFBOARD",)), (1, ("LOITER",)), (2, ("LOITER", "RTL")), (3, ("LOITER", "LAND"))],
)
def test_lost_sticks_hold_then_do_what_nav_rcl_act_says(action, modes, rig):
    rig.set(NAV_RCL_ACT=action, COM_FAIL_ACT_T=2.0)
    rig.sticks = None
    rig.run(0.8)
    assert mode(rig) == modes[0]
    assert "Manual control lost\t" in rig.texts()
    assert (HOLD in rig.texts()) is (len(modes) > 1)
    rig.run(2.0)
    assert mode(rig) == modes[-1]


@pytest.mark.parametrize("parameter", ["COM_RCL_EXCEPT", "COM_RC_IN_MODE"])
def test_lost_sticks_may_be_of_no_matter(parameter, rig):
    rig.set(**{parameter: 4})
    rig.sticks = None
    rig.run(2.0)
    assert mode(rig) == "OFFBOARD"


@pytest.mark.parametrize(
    ("action", "with_pilot", "alone"),
    [
        (0, "POSCTL", "RTL"),
        (1, "ALTCTL", "RTL"),
        (2, "STABILIZED", "RTL"),
        (3, "RTL", "RTL"),
        (4, "LAND", "LAND"),
        (5, "LOITER", "LOITER"),
    ],
)
def test_offboard_loss_with_a_pilot_and_alone(action, with_pilot, alone, rig):
    rig.set(COM_OBL_RC_ACT=action, COM_RC_IN_MODE=1)
    for sticks, expected in (((0, 0, 0), with_pilot), (None, alone)):
        rig.set(COM_RC_IN_MODE=1 if sticks else 4)
        rig.sticks = sticks
        rig.setpoint = {}
        rig.run(0.6)
        assert mode(rig) == "OFFBOARD", "streaming again re-enters"
        rig.setpoint = None
        rig.run(1.2)
        assert mode(rig) == expected
        assert rig.state.failsafe


@pytest.mark.parametrize("action", [6, 7])
def test_offboard_loss_may_turn_the_motors_off(action):
    rig = Rig(parameters={"COM_OBL_RC_ACT": action})
    rig.fly_offboard(height=3.0)
    rig.each_tick = None
    rig.run(1.2)
    assert not rig.state.armed
    assert "Disarmed by failsafe\t" in rig.texts()


def test_a_ground_station_may_be_of_no_matter_in_offboard_and_is_never_on_landing():
    rig = Rig(parameters={"NAV_DLL_ACT": 2, "COM_DLL_EXCEPT": 4, "COM_DL_LOSS_T": 3})
    rig.heartbeat()
    rig.fly_offboard(height=3.0)
    rig.run(6.0)
    assert mode(rig) == "OFFBOARD"
    assert "Connection to ground station lost\t" in rig.texts()
    assert rig.mode(4, 3) == ACCEPTED
    rig.each_tick = None
    rig.run(0.2)
    rig.heartbeat()
    rig.run(0.2)
    assert "GCS connection regained\t" in rig.texts()


def test_piloted_modes_can_be_entered_and_armed_in_with_a_pilot():
    rig = Piloted()
    assert rig.mode(3) == ACCEPTED
    assert rig.arm() == ACCEPTED
    alone = Rig()
    assert alone.mode(3) == ACCEPTED
    assert alone.arm() == TEMPORARILY_REJECTED
