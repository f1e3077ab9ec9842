"""Runs one vehicle in real time, or in lockstep with its companion."""

import os
import time
from collections.abc import Callable

from sitl_mock.connections import Connections
from sitl_mock.exchange import Exchange, ReceivedDatagram, burst_time
from sitl_mock.link.endpoint import Endpoint
from sitl_mock.link.framing import decode
from sitl_mock.settings import MockSettings
from sitl_mock.simulation import Simulation

FIRST_BEACON_PERIOD_S = 0.05
"""Wall time after which an unanswered first beacon is sent again, s."""
BEACON_PERIOD_S = 0.2
"""Wall time after which an unanswered later beacon is sent again, s."""
MAX_LAG_S = 1.0
"""Largest lag behind real time that the server makes up, s. A busy computer causes lags of tenths
of a second. If the server did not make them up, the link would seem slower to the companion.
"""

SPIN_S = 0.0005
"""In lockstep: time of polling for the answer before the server sleeps, s."""


class Server:
    """Runs one vehicle in real time or in lockstep.

    Args:
        show_status: shows the running vehicle after each slot, None = headless.

    Raises:
        ConfigError: an endpoint cannot be opened (see `Connections`), or the signing passphrase
            cannot be used.
    """

    def __init__(
        self,
        settings: MockSettings,
        system_id: int = 1,
        show_status: Callable[[Simulation], None] | None = None,
    ) -> None:
        self._settings = settings
        self._show_status = show_status
        self._simulation = Simulation(settings, system_id)
        self._exchange = Exchange(settings, self._simulation)
        self._connections = Connections(settings, self._simulation, self._exchange)
        self._companion = self._connections.companion
        self._in_lockstep = settings.lockstep.enabled
        self._beacon = b""
        self._beacon_answered = False
        self._collected_datagrams: list[ReceivedDatagram] = []
        self._origin_wall_s = 0.0
        self._origin_us = 0
        self._simulation.set_clock(self._clock_ns)

    @property
    def address(self) -> str:
        """Address of the companion endpoint, as text for the user."""
        return self._companion.address

    def run(self) -> None:
        """Run until an exception, such as `KeyboardInterrupt`, ends the run."""
        try:
            if self._settings.lockstep.enabled:
                self._await_answer_to_first_beacon()
            else:
                self._await_client()
                self._simulation.boot()
                self._connections.flush()
            self._reset_origin()
            while True:
                self._step()
        finally:
            self.close()

    def close(self) -> None:
        """Close the sockets."""
        self._connections.close()

    def _step(self) -> None:
        """Simulate one slot: in lockstep after the latest answer, else when it is due."""
        if not self._in_lockstep:
            self._wait_for_time()
        datagrams, self._collected_datagrams = self._collected_datagrams, []
        beacon = self._exchange.step(datagrams)
        if beacon is not None:
            self._beacon, self._beacon_answered = beacon, False
        self._connections.flush(beacon)
        if self._in_lockstep:
            self._await_answer()
        if self._show_status is not None:
            self._show_status(self._simulation)

    # Lockstep

    def _await_answer_to_first_beacon(self) -> None:
        """Send the first beacon until a client answers it; the simulation starts then.

        If no answer comes within ``patience_s`` of a client's first bytes, continue in real time.
        """
        self._beacon = self._simulation.beacon()
        self._connections.send_beacon(self._beacon)
        first_bytes_at: float | None = None
        while not self._beacon_answered:
            self._collect_until_answer(FIRST_BEACON_PERIOD_S)
            self._connections.send_beacon(self._beacon)
            now = time.monotonic()
            if first_bytes_at is None and self._companion.has_received:
                first_bytes_at = now
            if (
                first_bytes_at is not None
                and now - first_bytes_at > self._settings.lockstep.patience_s
            ):
                self._in_lockstep = False
                return

    def _await_answer(self) -> None:
        """Wait for the answer to the latest beacon; after ``patience_s`` leave lockstep."""
        self._collect_until_answer(BEACON_PERIOD_S)
        if self._beacon_answered:
            return
        deadline = time.monotonic() + self._settings.lockstep.patience_s - BEACON_PERIOD_S
        while not self._beacon_answered and time.monotonic() < deadline:
            self._connections.send_beacon(self._beacon)
            self._collect_until_answer(BEACON_PERIOD_S)
        if not self._beacon_answered:
            self._in_lockstep = False
            self._reset_origin()

    def _collect_until_answer(self, timeout_s: float) -> None:
        """Collect datagrams until the answer comes or the timeout ends.

        The server polls for a moment before it sleeps. Polling saves two wake-ups a step, which are
        most of the cost of a round trip.
        """
        began_s = time.monotonic()
        # Frames already buffered from a byte stream do not wake select.
        self._collect_companion_datagrams()
        self._poll(0.0)
        while not self._beacon_answered and time.monotonic() - began_s < SPIN_S:
            self._collect_companion_datagrams()
            os.sched_yield()  # let another process use this core
        while not self._beacon_answered:
            remaining_s = began_s + timeout_s - time.monotonic()
            if remaining_s <= 0.0:
                return
            self._poll(remaining_s)

    def _poll(self, timeout_s: float) -> None:
        """Wait at most ``timeout_s`` for input; collect the companion's, handle all other input."""
        for endpoint in self._connections.wait_for_input(timeout_s):
            if endpoint is self._companion:
                self._collect_companion_datagrams()
            else:
                self._serve(endpoint)

    def _collect_companion_datagrams(self) -> None:
        """Read the companion's datagrams up to and including the answer to the latest beacon."""
        while not self._beacon_answered:
            received = self._companion.receive()
            if received is None:
                return
            datagram, from_partner = received
            messages = decode(datagram)
            if from_partner and self._exchange.repeats_answer(messages):
                continue
            self._collected_datagrams.append((datagram, messages))
            if from_partner and self._exchange.answers_beacon(messages):
                self._beacon_answered = True

    # Real time

    def _await_client(self) -> None:
        """Wait until a client connects over TCP; UDP and serial links do not wait."""
        while not self._companion.connected:
            self._connections.wait_for_input(BEACON_PERIOD_S)

    def _reset_origin(self) -> None:
        """Let the present wall-clock time correspond to the present vehicle time."""
        self._origin_wall_s = time.monotonic()
        self._origin_us = self._simulation.time_us

    def _wait_for_time(self) -> None:
        """Serve the sockets until the next slot is due by the wall clock.

        The server does not make up a lag above `MAX_LAG_S`, or the time of a ``slip_clock`` fault.
        """
        self._origin_wall_s += self._simulation.effects.take_clock_slip()
        speed = self._settings.speed
        elapsed_s = (self._simulation.next_us - self._origin_us) / speed / 1e6
        due_s = self._origin_wall_s + burst_time(elapsed_s, self._settings.burst_ms * 1e-3 / speed)
        remaining_s = due_s - time.monotonic()
        if remaining_s < -MAX_LAG_S:
            self._reset_origin()
        while True:
            for endpoint in self._connections.wait_for_input(max(0.0, remaining_s)):
                self._serve(endpoint)
            remaining_s = due_s - time.monotonic()
            if remaining_s <= 0.0 or self._in_lockstep:
                return

    def _serve(self, endpoint: Endpoint) -> None:
        """Read and handle all waiting datagrams of an endpoint, and send the answers."""
        while (received := endpoint.receive()) is not None:
            datagram, from_partner = received
            messages = decode(datagram)
            self._connections.deliver([(datagram, messages)], endpoint)
            in_lockstep = self._settings.lockstep.enabled and endpoint is self._companion
            if in_lockstep and from_partner and self._exchange.answers_beacon(messages):
                # The latest beacon is answered: lockstep resumes.
                self._beacon_answered = self._in_lockstep = True
        self._connections.flush()

    def _clock_ns(self) -> int:
        """Return vehicle time for TIMESYNC, ns.

        In real time vehicle time advances between slots with the wall clock, up to the next slot.
        While a fault freezes the clock, the result stays constant.
        """
        simulation = self._simulation
        if self._in_lockstep or simulation.effects.clock_frozen:
            return simulation.state.stamp_us * 1000
        wall_us = (time.monotonic() - self._origin_wall_s) * 1e6 * self._settings.speed
        now_us = min(self._origin_us + wall_us, simulation.next_us)
        return round(max(now_us, simulation.time_us) * 1000)
