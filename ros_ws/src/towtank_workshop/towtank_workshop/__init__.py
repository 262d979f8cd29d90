# SPDX-License-Identifier: Apache-2.0
"""What a workshop needs of a rig: drawings, masses and ballast, check list of a bring-up."""
