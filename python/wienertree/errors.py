"""The exceptions of wienertree, of one family."""


class Error(Exception):
    """What went wrong, where (file and key, step and node, option), and the offending value as text."""

    def __init__(self, what: str, where: str = "", value: str = ""):
        super().__init__(what, where, value)
        self.what = what
        self.where = where
        self.value = value

    def __str__(self) -> str:
        text = f"{self.where}: {self.what}" if self.where else self.what
        return f"{text} ({self.value})" if self.value else text


class InputError(Error, ValueError):
    """The caller's input is wrong: a file, an option, a model."""


class RunError(Error, RuntimeError):
    """The computation failed on valid input: an ODE, a posterior without mass."""
