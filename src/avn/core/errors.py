"""Exception for mistakes of the user."""


class UserError(Exception):
    """Mistake of the user: one line that names the option or file and says what to do.

    Commands print it without a traceback and exit with code 2.
    """
