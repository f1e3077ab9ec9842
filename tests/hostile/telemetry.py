"""What the hostile vehicle tells: its messages as fields, when each is due, and the lies in it."""

from math import inf

from sitl_mock.link.framing import Framer
from tests.hostile.personality import ACCEPTED, FAILED
from tests.hostile.vehicle import HOME_ALTITUDE

PREARM_CHECK = 0x10000000
_LATITUDE, _LONGITUDE = 473977000, 85456000


class Telemetry:
    """Makes frames out of the vehicle's state.

    Attributes:
        rates: Hz by message; a script may change them.
        fixed: messages whose rate SET_MESSAGE_INTERVAL does not change.
        lies: [message, fields or a function of them, until]; later ones win.
        delays: s, or a function of time, by message; "*" for all that is streamed.
        clock: true time in s → boot time in s, as stamped.
        battery, fix_type, flags: as told.
        samples: each attitude sent, as (step's time, stamp in ms, measured at).
        told: each mode told, as (time, mode, armed).
    """

    def __init__(self, vehicle):
        self._vehicle = vehicle
        self.rates, self.fixed = dict(vehicle.kind.default_rates), set()
        self.lies, self.delays, self._queue = [], {}, []
        self.clock = lambda t: t
        self.battery, self.fix_type, self.flags = 0.8, 3, vehicle.kind.estimator[1]
        self.samples, self.told = [], []
        self._due, self._latest, self._mode_sent = {}, [], (-inf, None)
        self._dialect = vehicle.kind.dialect
        self._framer = Framer(1, 1)
        self._makers = {
            "HEARTBEAT": self.heartbeat,
            "CURRENT_MODE": self._current_mode,
            "SYS_STATUS": self._sys_status,
            "EXTENDED_SYS_STATE": lambda: {"vtol_state": 0, "landed_state": vehicle.landed_state},
            "ATTITUDE_QUATERNION": self._attitude,
            "LOCAL_POSITION_NED": self._position,
            "HOME_POSITION": self._home,
            "GPS_RAW_INT": self._gps,
            "GLOBAL_POSITION_INT": self._global_position,
            "BATTERY_STATUS": self._battery,
            "ATTITUDE_TARGET": self._attitude_target,
            vehicle.kind.estimator[0]: getattr(self, "_" + vehicle.kind.estimator[0].lower()),
        }
        if not vehicle.kind.enters_by_setpoint:
            self._makers["ODOMETRY"] = self._odometry

    @property
    def stamp_ms(self):
        """Boot time in ms, as a uint32."""
        return round(self.clock(self._vehicle.t) * 1000.0) & 0xFFFFFFFF

    def due(self):
        """The frames that leave in this step."""
        t = self._vehicle.t
        for name, rate in self.rates.items():
            if rate > 0.0 and name in self._makers and t >= self._due.get(name, -inf) - 1e-6:
                self._due[name] = max(self._due.get(name, t) + 1.0 / rate, t)
                if name != "CURRENT_MODE" or self._mode_is_due():
                    self._queue.append(self._entry(name))
        leaving = [entry for entry in self._queue if entry[0] <= t + 1e-6]
        self._queue = [entry for entry in self._queue if entry[0] > t + 1e-6]
        return [frame for entry in leaving for frame in self._leave(*entry)]

    def _mode_is_due(self):
        """PX4 sends CURRENT_MODE at once when something changes, else every 0.5 s."""
        t, state = self._vehicle.t, (self._vehicle.mode, self._vehicle.armed)
        at, before = self._mode_sent
        if state == before and t < at + 0.5 - 1e-6:
            return False
        self._mode_sent = t, state
        return True

    def set_interval(self, number, interval_us):
        """Answer SET_MESSAGE_INTERVAL; returns the MAV_RESULT."""
        name, kind = self._message_name(number), self._vehicle.kind
        if name == "HEARTBEAT" and not kind.heartbeat_can_be_asked:
            return FAILED
        if name not in self.fixed:
            self.rates[name] = 1e6 / interval_us if interval_us > 0 else 0.0
            self._due.pop(name, None)
        return ACCEPTED

    def requested(self, number, uid):
        """The frames of a message asked for by its number; None where there is none."""
        name = self._message_name(number)
        if name == "AUTOPILOT_VERSION":
            return self.pack(name, _version(uid))
        if name not in self._makers:
            return None
        self._queue.append(self._entry(name))  # it waits where the streamed ones wait
        return []

    def _message_name(self, number):
        kind = self._dialect.mavlink_map.get(int(number))
        return None if kind is None else kind.msgname

    def pack(self, name, *messages):
        """Frames of messages, given as fields."""
        make = getattr(self._dialect, f"MAVLink_{name.lower()}_message")
        return [self._framer.frame(make(**fields)) for fields in messages]

    def _told(self, name, fields):
        """What the lies make of a message's fields: one message, several or none."""
        for told, change, until in self.lies:
            if name == told and self._vehicle.t < until and fields is not None:
                fields = change(fields) if callable(change) else {**fields, **change}
        if fields is None:
            return []
        return fields if isinstance(fields, list) else [fields]

    def _entry(self, name):
        t, delay = self._vehicle.t, self.delays.get(name, self.delays.get("*", 0.0))
        return t + (delay(t) if callable(delay) else delay), name, self._makers[name](), t

    def _leave(self, _, name, fields, measured):
        t, told = self._vehicle.t, self._told(name, fields)
        if name == "ATTITUDE_QUATERNION":
            for each in told:
                again = [at for sample, at in self._latest if sample is each]
                at = again[0] if again else measured
                self._latest = [*self._latest[-3:], (each, at)]
                self.samples.append((t, each["time_boot_ms"], at))
        if name in ("HEARTBEAT", "CURRENT_MODE") and told:
            self.told.append((t, self._vehicle.mode, self._vehicle.armed))
        return self.pack(name, *told)

    # --- messages

    def heartbeat(self):
        """Fields of a true HEARTBEAT."""
        vehicle = self._vehicle
        return {
            "type": 2,
            "autopilot": vehicle.kind.autopilot,
            "base_mode": vehicle.kind.base_mode(vehicle.mode, armed=vehicle.armed),
            "custom_mode": vehicle.kind.custom_modes[vehicle.mode],
            "system_status": vehicle.system_status,
            "mavlink_version": 3,
        }

    def _current_mode(self):
        custom = self._vehicle.kind.custom_modes[self._vehicle.mode]
        return {"standard_mode": 0, "custom_mode": custom, "intended_custom_mode": custom}

    def _attitude(self):
        (w, x, y, z), (p, q, r) = self._vehicle.body.q, self._vehicle.body.rates
        fields = {"time_boot_ms": self.stamp_ms, "q1": w, "q2": x, "q3": y, "q4": z}
        return {**fields, "rollspeed": p, "pitchspeed": q, "yawspeed": r}

    def _position(self):
        body = self._vehicle.body
        places = dict(zip(("x", "y", "z"), body.position, strict=True))
        speeds = dict(zip(("vx", "vy", "vz"), body.velocity, strict=True))
        return {"time_boot_ms": self.stamp_ms, **places, **speeds}

    def _sys_status(self):
        health = PREARM_CHECK if self._vehicle.prearm_good else 0
        sensors = ("onboard_control_sensors_present", "onboard_control_sensors_enabled")
        zeros = ("load", "drop_rate_comm", "errors_comm")
        counts = tuple(f"errors_count{number}" for number in range(1, 5))
        return {
            **dict.fromkeys(sensors, PREARM_CHECK),
            **dict.fromkeys((*zeros, *counts), 0),
            "onboard_control_sensors_health": health,
            "voltage_battery": 16000,
            "current_battery": 100,
            "battery_remaining": round(100 * self.battery),
        }

    def _battery(self):
        unused = ("id", "battery_function", "type")
        return {
            **dict.fromkeys(unused, 0),
            "temperature": 2500,
            "voltages": [16000, *[65535] * 9],
            "current_battery": 100,
            "current_consumed": 0,
            "energy_consumed": 0,
            "battery_remaining": round(100 * self.battery),
        }

    def _home(self):
        zeros = ("x", "y", "z", "approach_x", "approach_y", "approach_z")
        place = {"latitude": _LATITUDE, "longitude": _LONGITUDE}
        altitude = round(1000 * HOME_ALTITUDE)
        return {**place, "altitude": altitude, **dict.fromkeys(zeros, 0.0), "q": [1, 0, 0, 0]}

    def _gps(self):
        fields = {"time_usec": 1000 * self.stamp_ms, "fix_type": self.fix_type}
        fields |= {"lat": _LATITUDE, "lon": _LONGITUDE, "alt": round(1000 * HOME_ALTITUDE)}
        return fields | {"eph": 80, "epv": 80, "vel": 0, "cog": 0, "satellites_visible": 12}

    def _global_position(self):
        above = round(1000 * self._vehicle.body.height)
        fields = {"time_boot_ms": self.stamp_ms, "lat": _LATITUDE, "lon": _LONGITUDE}
        fields |= {"alt": round(1000 * HOME_ALTITUDE) + above, "relative_alt": above}
        return fields | {"vx": 0, "vy": 0, "vz": 0, "hdg": 0}

    def _estimator_status(self):
        ratios = ("vel_ratio", "pos_horiz_ratio", "pos_vert_ratio", "mag_ratio", "hagl_ratio")
        others = ("tas_ratio", "pos_horiz_accuracy", "pos_vert_accuracy")
        zeros = dict.fromkeys((*ratios, *others), 0.1)
        return {"time_usec": 1000 * self.stamp_ms, "flags": self.flags, **zeros}

    def _ekf_status_report(self):
        kinds = ("velocity", "pos_horiz", "pos_vert", "compass", "terrain_alt")
        return {"flags": self.flags, **{f"{kind}_variance": 0.1 for kind in kinds}}

    def _attitude_target(self):
        (p, q, r), thrust = self._vehicle.setpoint
        rates = {"body_roll_rate": p, "body_pitch_rate": q, "body_yaw_rate": r}
        start = {"time_boot_ms": self.stamp_ms, "type_mask": 0, "q": list(self._vehicle.body.q)}
        return {**start, **rates, "thrust": thrust}

    def _odometry(self):
        body, unknown = self._vehicle.body, [float("nan"), *[0.0] * 20]
        numbers = (*body.position, *body.velocity, *body.rates)
        names = ("x", "y", "z", "vx", "vy", "vz", "rollspeed", "pitchspeed", "yawspeed")
        fields = {"time_usec": 1000 * self.stamp_ms, "frame_id": 1, "child_frame_id": 1}
        fields |= {"q": list(body.q), **dict(zip(names, numbers, strict=True))}
        return fields | {"pose_covariance": unknown, "velocity_covariance": unknown}


def _version(uid):
    zeros = ("middleware_sw_version", "os_sw_version", "board_version", "vendor_id", "product_id")
    hashes = {f"{part}_custom_version": [0] * 8 for part in ("flight", "middleware", "os")}
    told = {"capabilities": 0xE8FF, "flight_sw_version": 0x011000FF, "uid": uid}
    return {**dict.fromkeys(zeros, 0), **hashes, **told, "uid2": [uid] * 18}
