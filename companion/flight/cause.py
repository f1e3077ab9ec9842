"""Why a flight ended, as the telemetry after its end shows."""

import asyncio

from companion.flight.commands import FAILSAFE_TEXT, DisarmedUnwatched, ModeTakenOver
from companion.flight.context import FlightContext
from companion.safety.actions import ControlReleased, Exit, FlightEnded

_EVIDENCE_DELAY = 0.3
"""Largest time from a mode change to the STATUSTEXT with its reason, or to the answer to a TIMESYNC
request, s."""
_ON_GROUND_TEXT = "the vehicle stands on the ground, disarmed: it landed or fell unwatched"


async def with_cause(context: FlightContext, ended: FlightEnded) -> FlightEnded:
    """Return `ended`, with the reason that the telemetry after it shows.

    ArduPilot reports a geofence breach only in a STATUSTEXT. An autopilot that restarts comes back
    disarmed and in another mode, as if a pilot had taken it; only its clock tells. A failsafe may
    have landed the vehicle while this program was stopped. Control is released before this function
    waits.
    """
    state, is_taken = context.link.state, isinstance(ended, ModeTakenOver | ControlReleased)
    fence_text = context.link.autopilot.fence_text if is_taken else None
    may_have_restarted = ended.exit is Exit.RELEASE and state.armed is False
    if fence_text is None and not may_have_restarted:
        return ended
    context.release()
    mode, earliest_text_time = state.mode, state.mode_received_at - _EVIDENCE_DELAY
    context.link.timesync.send_exchange_request()
    await asyncio.sleep(_EVIDENCE_DELAY)  # a vehicle that was disarmed in the air falls by now
    if (restart := context.replacement_detector.restart_in_words()) is not None:
        return FlightEnded(restart, ended.exit)
    if isinstance(ended, DisarmedUnwatched) and context.ground.resting:
        return FlightEnded(_ON_GROUND_TEXT, ended.exit)
    texts = [each.text for each in state.texts if each.time >= earliest_text_time]
    if fence_text is not None and any(fence_text in text for text in texts):
        return FlightEnded(f"{FAILSAFE_TEXT}: mode {mode}", ended.exit)
    return ended
