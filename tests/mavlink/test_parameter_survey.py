"""Reading the parameters that matter, under whichever of their names the autopilot knows them."""

import asyncio

from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.mavlink.ardupilot_parameters import ARDUPILOT_PARAMETERS
from companion.mavlink.parameter_survey import survey
from tests.mavlink.fakes import linked

OLD = {"SYSID_MYGCS": 255.0, "FS_OPTIONS": 16.0}
WANTED = ("FS_OPTIONS", "MAV_GCS_SYSID", "ARMING_SKIPCHK")


def test_an_old_version_answers_to_the_old_names():
    rules = [rule for rule in ARDUPILOT_PARAMETERS if rule.name in WANTED]
    asked = []

    def answer(request):
        asked.append(request.param_id)
        if request.param_id not in OLD:
            return []
        name = request.param_id.encode()
        return [dialect.MAVLink_param_value_message(name, OLD[request.param_id], 9, 2, 0)]

    async def scene():
        async with linked() as (link, vehicle):
            vehicle.answers["PARAM_REQUEST_READ"] = answer
            return await survey(link, rules, timeout_s=0.05, retries=0)

    values = asyncio.run(scene())
    assert values == {"MAV_GCS_SYSID": 255.0, "FS_OPTIONS": 16.0}
    assert asked == ["MAV_GCS_SYSID", "SYSID_MYGCS", "FS_OPTIONS", "ARMING_SKIPCHK"]
