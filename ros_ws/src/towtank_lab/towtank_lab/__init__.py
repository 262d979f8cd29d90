# SPDX-License-Identifier: Apache-2.0
"""Laboratory procedures: calibration of sensors, inertia, ballast and trim, Froude scaling."""
