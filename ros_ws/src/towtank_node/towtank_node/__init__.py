# SPDX-License-Identifier: Apache-2.0
"""What every towtank node shares: parameters, quality of service, diagnostics, main loop."""
