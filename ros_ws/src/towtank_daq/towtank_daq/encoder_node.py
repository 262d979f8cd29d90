# SPDX-License-Identifier: Apache-2.0
"""Node of the two encoders: scans in, position and velocity of crank, carriage and tow point out.

The tow point's heave (m, upwards, as a joint that slides) follows from the crank's angle by the
mechanism's kinematics. Angle and heave come with their uncertainty, too.

After a reset of the board positions are not known and NaN, until somebody zeroes them.
"""

from __future__ import annotations

import math
from array import array

from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from towtank_interfaces.msg import AdcScan, CrankMotion
from towtank_node import names, topics
from towtank_node.endpoints import publisher, server
from towtank_node.parameters import Parameter
from towtank_node.services import ZERO
from towtank_node.stamps import set_stamp, stamp_ns
from towtank_rig.motion import tow_point_motion
from towtank_uncertainty.crank_budget import CrankBudget

from towtank_daq.encoder import UNKNOWN, WINDOW_S, Drive, DriveWatch, Origin
from towtank_daq.scan_node import ScanNode

_PARAMETERS = (
    Parameter(
        "velocity_window_s",
        float,
        "span of the positions that a velocity is fitted to, s",
        WINDOW_S,
        minimum=0.03,
        maximum=2.0,
    ),
)


_CRANK_MOTION_NS = 100_000_000
"""Between two messages of the crank's uncertainty, which goes evenly with its angle: with every
scan they would cost a tenth of the sensors' processor time."""


class EncoderNode(ScanNode):
    """Positions count from the first scan, or from the last call of ~/zero."""

    def __init__(self) -> None:
        super().__init__(names.ENCODER_NODE, _PARAMETERS)
        self._watch = DriveWatch(self.rig, self.parameters.velocity_window_s)
        self._motion = tow_point_motion(self.rig.tow_point)
        self._lost = False
        self._joints = JointState()
        self._joints.name = [names.CRANK_JOINT, names.CARRIAGE_JOINT, names.TOW_POINT_JOINT]
        # Nobody measures efforts, but not all readers of bags take an empty sequence at the end.
        self._joints.effort = [math.nan] * 3
        self._budget = CrankBudget(self.rig)
        self._crank_motion = CrankMotion()
        self._crank_motion.header.frame_id = names.CRANK_FRAME
        self._crank_motion_ns = 0  # when it was published last
        self._crank_motions = publisher(self, topics.CRANK_MOTION)
        self._publisher = publisher(self, topics.MEASURED_JOINTS)
        if kept := self.kept_zero.read():
            self._watch.restore(*(Origin(*origin) for origin in kept["origins"]))
            self._crank_motion.zeroed = kept["zeroed"]
        self._kept_origins: tuple[Origin, Origin] | None = self._watch.origins
        server(self, ZERO.of("~"), self._on_zero)

    def drive_at(self, scan: AdcScan) -> Drive:
        """How the drive moves at a scan, for this node and for those of the other sensors."""
        with self.one_at_a_time:
            try:
                return self._watch.update(
                    stamp_ns(scan.header.stamp),
                    scan.crank_count,
                    scan.carriage_count,
                    scan.count_epoch,
                )
            except Exception as error:  # noqa: BLE001 - the thread has others to serve
                self.fault(error)
                return UNKNOWN

    def take(self, scan: AdcScan, drive: Drive) -> None:
        # The board latches the counts at the scan's tick: no delay to add
        sampled_ns = stamp_ns(scan.header.stamp)
        set_stamp(self._joints.header.stamp, sampled_ns)
        heave, heave_rate = self._motion.heave_of(drive.crank_angle, drive.crank_rate)
        self._joints.position = array("d", (drive.crank_angle, drive.carriage_position, heave))
        self._joints.velocity = array("d", (drive.crank_rate, drive.carriage_speed, heave_rate))
        self._publisher.publish(self._joints)
        if abs(sampled_ns - self._crank_motion_ns) >= _CRANK_MOTION_NS:
            self._crank_motion_ns = sampled_ns
            self._publish_crank_motion(sampled_ns, drive.crank_angle, heave)
        self.ready()
        self._tell_reference()
        if (origins := self._watch.origins) != self._kept_origins:
            self._kept_origins = origins
            self.keep_zero(origins=origins, zeroed=self._crank_motion.zeroed)

    def _tell_reference(self) -> None:
        lost = self._watch.lost
        if lost == self._lost:
            return
        self._lost = lost
        if lost:
            self._crank_motion.zeroed = False
            what = (
                "the board was reset: the positions of crank and carriage are not known; bring "
                f"both to where they are zero and call {ZERO.of(names.ENCODER_NODE).name}"
            )
            self.get_logger().warning(what)
            self.diagnostics.warn(what)
        else:
            self.get_logger().info("crank and carriage are zeroed again")
            self.say_ready()

    def _publish_crank_motion(self, sampled_ns: int, angle: float, heave: float) -> None:
        message = self._crank_motion
        set_stamp(message.header.stamp, sampled_ns)
        message.angle, message.heave = angle, heave
        for name, uncertainty in zip(("angle", "heave"), self._budget.at(angle), strict=True):
            setattr(message, f"{name}_standard_uncertainty", uncertainty.combined)
            setattr(message, f"{name}_type_a_uncertainty", uncertainty.type_a)
            setattr(message, f"{name}_type_b_uncertainty", uncertainty.type_b)
            setattr(message, f"{name}_u95", uncertainty.u95)
        self._crank_motions.publish(message)

    def _on_zero(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        with self.one_at_a_time:
            self._watch.zero()
            self._crank_motion.zeroed = True
            self._crank_motion_ns = 0  # told with the next scan
            self._kept_origins = None  # kept with it
        response.success = True
        response.message = "crank and carriage are zero at the next scan"
        return response
