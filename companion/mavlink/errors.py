"""The errors of the link to the vehicle; each has one clear message."""


class LinkError(Exception):
    """The base class of all errors of `companion.mavlink`."""


class EndpointError(LinkError):
    """The endpoint is not valid or cannot be opened; the message tells what to do."""


class LinkTimeout(LinkError):  # noqa: N818 - "timeout" already says that it is an error
    """The expected message did not come in the given time."""


class LinkLost(LinkError):  # noqa: N818
    """The connection dropped while something was waiting for an answer over it."""


class NotConnected(LinkError):  # noqa: N818
    """No heartbeat of an autopilot that this program flies has been received yet."""


class UnsupportedAutopilot(LinkError):  # noqa: N818
    """The vehicle's autopilot is neither PX4 nor ArduPilot, or the vehicle is no multirotor."""


class UnknownMessage(LinkError):  # noqa: N818
    """The dialect has no message of that name."""


class LogError(LinkError):
    """A `.tlog` cannot be used; the message says why."""


class SigningError(LinkError):
    """The signing key cannot be used, or there is no folder for the time stamps of signatures."""


class InvalidSetpoint(LinkError, ValueError):  # noqa: N818
    """A setpoint that must not reach the vehicle; nothing was sent."""


class CommandTimeout(LinkTimeout):
    """No COMMAND_ACK came for a command after all retries."""


class CommandUnfinished(CommandTimeout):
    """The autopilot answered that a command is in progress, and never that it is done."""


class CommandRefused(LinkError):  # noqa: N818
    """The autopilot's final answer to a command is anything but ACCEPTED.

    Attributes:
        command: the command's name, such as `MAV_CMD_COMPONENT_ARM_DISARM`.
        result: MAV_RESULT number of the ACK.
        result_name: the result without its prefix, such as `TEMPORARILY_REJECTED`.
        texts: the autopilot's texts (STATUSTEXT, or PX4's events) from the command until 0.3 s
            after the refusal, oldest first; may be empty.
    """

    def __init__(self, command: str, result: int, result_name: str, texts: tuple[str, ...]) -> None:
        self.command = command
        self.result = result
        self.result_name = result_name
        self.texts = texts
        reason = "; ".join(texts) if texts else "the autopilot gave no reason"
        super().__init__(f"{command} was refused ({result_name}): {reason}")


class ParameterError(LinkError):
    """The base class of parameter errors."""


class UnknownParameter(ParameterError):  # noqa: N818
    """The autopilot has no parameter of that name or did not answer, or the name is not valid."""


class UnansweredParameter(UnknownParameter):
    """The autopilot did not answer: the parameter does not exist, or frames were lost."""


class ParameterRefused(ParameterError):  # noqa: N818
    """The autopilot refused the request or kept another value, or the value has a wrong type."""
