# SPDX-License-Identifier: Apache-2.0
"""Simulation of towed cable systems: lumped-mass lines, depressors and tow-fish.

Frames: tank axes x forward along the run, z up, z = 0 at still water; body axes x forward,
y to port, z up, origin at mid-hull. SI units throughout, angles in rad.

    builder = ModelBuilder(water=Water())
    builder.add_prescribed_point("tow_point")
    ...
    model = builder.build()
    motion = Sinusoid(mean=(0, 0, -2), velocity=(1, 0, 0), amplitude=0.1, period=2)
    result = run(model, motion, t_end=60)
"""

from sim_core._core import (
    HHT,
    BackwardEuler,
    Body,
    Box,
    ConvergenceError,
    Downwash,
    EmergencyStop,
    Energy,
    EnergyBalance,
    Fin,
    ForwardEuler,
    GeneralizedAlpha,
    HullTable,
    Integrator,
    InvalidInput,
    LineProperties,
    Model,
    ModelBuilder,
    MomentumBalance,
    Motion,
    MotionSample,
    MotionSum,
    Newmark,
    Sea,
    Simulator,
    SingleStepHoubolt,
    Sinusoid,
    SliderCrank,
    State,
    SteadyTow,
    TimeSeries,
    Turn,
    Water,
    energy,
    jonswap_sea,
    regular_waves,
    steady_tow,
    wave_number,
)
from sim_core.added_mass import (
    LambCoefficients,
    about_origin,
    fin_added_mass,
    hull_added_mass,
    lamb_coefficients,
)
from sim_core.fin_coefficients import body_lift_factor, downwash_slope, lift_slope
from sim_core.hull_tables import hull_of_revolution, polynomial_hull
from sim_core.mass_properties import (
    MassProperties,
    Part,
    cylinder_gyration,
    enclosed_water,
    mass_properties,
)
from sim_core.moordyn_file import MoorDynDeck, read_moordyn
from sim_core.plotting import animate, plot_shape
from sim_core.result import BodyHistory, LineHistory, PlaceHistory, PointHistory, Result
from sim_core.running import run
from sim_core.static_stability import StaticStability, static_stability, trimmed_pitch
from sim_core.system import (
    FreePoint,
    Line,
    PrescribedPoint,
    SectionedLine,
    System,
    Weathervane,
)

__all__ = [
    "HHT",
    "BackwardEuler",
    "Body",
    "BodyHistory",
    "Box",
    "ConvergenceError",
    "Downwash",
    "EmergencyStop",
    "Energy",
    "EnergyBalance",
    "Fin",
    "ForwardEuler",
    "FreePoint",
    "GeneralizedAlpha",
    "HullTable",
    "Integrator",
    "InvalidInput",
    "LambCoefficients",
    "Line",
    "LineHistory",
    "LineProperties",
    "MassProperties",
    "Model",
    "ModelBuilder",
    "MomentumBalance",
    "MoorDynDeck",
    "Motion",
    "MotionSample",
    "MotionSum",
    "Newmark",
    "Part",
    "PlaceHistory",
    "PointHistory",
    "PrescribedPoint",
    "Result",
    "Sea",
    "SectionedLine",
    "Simulator",
    "SingleStepHoubolt",
    "Sinusoid",
    "SliderCrank",
    "State",
    "StaticStability",
    "SteadyTow",
    "System",
    "TimeSeries",
    "Turn",
    "Water",
    "Weathervane",
    "about_origin",
    "animate",
    "body_lift_factor",
    "cylinder_gyration",
    "downwash_slope",
    "enclosed_water",
    "energy",
    "fin_added_mass",
    "hull_added_mass",
    "hull_of_revolution",
    "jonswap_sea",
    "lamb_coefficients",
    "lift_slope",
    "mass_properties",
    "plot_shape",
    "polynomial_hull",
    "read_moordyn",
    "regular_waves",
    "run",
    "static_stability",
    "steady_tow",
    "trimmed_pitch",
    "wave_number",
]
