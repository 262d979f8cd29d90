# SPDX-License-Identifier: Apache-2.0
"""The error of a procedure that its readings do not carry."""


class ProcedureError(ValueError):
    """Readings from which the wanted cannot be found; one line with cause and mend."""
