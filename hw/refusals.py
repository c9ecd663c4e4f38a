"""What the code of a device raised, in words: it may come from outside, and raise where it must not."""

from __future__ import annotations

from collections.abc import Callable

from hw.interface import BackendError


class DeviceMistakeError(Exception):
    """What the code of a device raised and must not; the text names the device, its axes and the method."""


def raised_by(action: Callable[[], object]) -> Exception | None:
    """What `action` raised; None where it did not. Only for what must go on, or end in words, whatever that
    was."""
    try:
        action()
    except Exception as error:  # noqa: BLE001 - whatever it was: the caller stops the actuator and tells it
        return error
    return None


def words_of(error: BaseException) -> str:
    """An error in one line: what a device or the system says speaks for itself, any other names its kind."""
    text = str(error)
    if isinstance(error, BackendError | DeviceMistakeError | OSError) and text:
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def mistake_of(place: str, doing: str, error: Exception) -> DeviceMistakeError:
    """What a device's code raised and must not, with its name; one that has a name keeps it."""
    if isinstance(error, DeviceMistakeError):
        return error
    return DeviceMistakeError(f"{place}: {doing}: {words_of(error)}")


def story_of(error: BaseException) -> str:
    """As `words_of`, with what was being dealt with when it was raised: a stop that fails must not hide why
    there was one."""
    before = None if error.__suppress_context__ else error.__context__
    return words_of(error) if before is None else f"{story_of(before)}; then {words_of(error)}"
