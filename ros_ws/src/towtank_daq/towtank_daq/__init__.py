# SPDX-License-Identifier: Apache-2.0
"""From the ADC board's serial line to sensor topics: protocol, driver, board and sensor nodes."""
