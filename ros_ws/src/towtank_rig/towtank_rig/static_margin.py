# SPDX-License-Identifier: Apache-2.0
"""Static margin of the tow-fish in pitch."""

from towtank_rig.tow import Fish


def static_margin(fish: Fish, water_density: float) -> float | None:
    """Return how far the neutral point lies abaft the centre of gravity, as a share of the length.

    At a small angle of attack the horizontal fins lift at their places, and the hull adds the Munk
    moment ``(added lateral − added axial mass)·U²`` (Lamb), times the rig's factor; the hull's own
    lift is left out. A positive margin means that the fish turns its nose back into the flow.
    None without horizontal fins: there is no lift and no neutral point.
    """
    fins = [fin for fin in fish.fins if fin.plane == "horizontal"]
    if not fins:
        return None
    # All per squared speed: N/rad and N·m/rad at 1 m/s.
    lifts = [0.5 * water_density * fin.area.value * fin.lift_slope.value for fin in fins]
    fin_moment = sum(lift * fin.position.x.value for lift, fin in zip(lifts, fins, strict=True))
    added = fish.added_mass_lateral.value - fish.added_mass_axial.value
    munk_moment = fish.munk_moment.value * added * fish.displaced_mass
    neutral_point = (fin_moment + munk_moment) / sum(lifts)
    return (fish.centre_of_gravity.x.value - neutral_point) / fish.length.value
