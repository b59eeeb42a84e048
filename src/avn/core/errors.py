"""The one exception for mistakes that a user can make and mend."""


class UserError(Exception):
    """A mistake of the user's: one line that names the option or file and says what to do.

    The commands print it without a traceback and exit with code 2.
    """
