# SPDX-License-Identifier: Apache-2.0
"""First harmonic of a motion at the crank frequency, with the uncertainty that its scatter gives.

The model, fitted by least squares to samples y at times t and crank angles θ, is

    y = s(θ) + Σₖ (aₖ cos kθ + bₖ sin kθ),   k = 1, 2, 3,

s being a cubic spline with a knot at every whole turn of the crank. It takes what is slower than
half the crank frequency: drift of the sensors, and the fish's slow swing about its depth, which a
start or a turn leaves behind and which a parabola over the window does not follow. A dying swing
of 40 mm with a period of five turns leaks 0.02 mm into the harmonic over ten turns, with a parabola
1.6 mm; the price is 4 % more noise. Because θ is the measured angle, an unsteady crank smears
nothing.

What the fit leaves over is noise and slow motion of the tow, and neighbouring samples of it are
correlated. What counts for the first harmonic is only the noise near the crank frequency. It is
measured as in P. D. Welch's method (IEEE Trans. Audio Electroacoust. AU-15, 1967): segments of two
crank periods, half overlapping, with a Hann window, whose zero at frequency nought keeps slow
motion out. The mean power of the segments at the crank frequency, divided by what white noise of
unit variance would leave there after the fit (worked out exactly for the samples at hand, gaps and
all), is σ²: the variance of white noise that is as strong at the crank frequency. With it

    cov(a₁, b₁) = σ² (XᵀX)⁻¹,   effective number of independent samples = n s²/σ²,

s² being the variance of the residuals. Its degrees of freedom follow from the moments of the
quadratic form (F. E. Satterthwaite, Biometrics Bull. 2, 1946). For the uncertainty of means of
correlated samples see also A. Zięba, Metrol. Meas. Syst. 17, 2010.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import solve_triangular

HARMONICS = 3
SEGMENT_PERIODS = 2
MIN_PERIODS = 2
MIN_SAMPLES_PER_PERIOD = 8
"""On average. Three harmonics need six; two more leave something to judge the scatter by."""

MAX_CONDITION = 1e3
"""Of the regressors: beyond it a gap leaves the harmonics undetermined. Up to 20 whole periods
without gaps give less than 25."""


class AnalysisError(ValueError):
    """The samples do not allow a result; the text says why, in one line."""


@dataclass(frozen=True)
class Harmonic:
    """First harmonic of one motion, y₁(θ) = Re(value·e^{iθ}), and the noise around it.

    value: complex amplitude, in the unit of the samples.
    variance: of its real part and of its imaginary part (mean of the two), from the scatter.
    dof: degrees of freedom of `variance`.
    segments: complex shape (periods − 1,), what each segment of the residuals holds at the crank
        frequency, scaled so that their squares add up to `variance`·2.
    residual_rms, effective_samples: see the module's text. samples: number of samples used.
    """

    value: complex
    variance: float
    dof: float
    segments: np.ndarray
    residual_rms: float
    samples: int
    effective_samples: float

    @property
    def amplitude(self) -> float:
        """Amplitude, in the unit of the samples."""
        return abs(self.value)

    @property
    def phase(self) -> float:
        """Lead over cos θ, rad."""
        return math.atan2(self.value.imag, self.value.real)


def fit_first_harmonic(
    values: np.ndarray, angle: np.ndarray, start_angle: float, periods: int
) -> Harmonic:
    """Fit the model to samples inside `periods` whole crank periods from `start_angle` on.

    values, angle: shape (n,); angle in rad, growing with the crank's turning.
    Raises AnalysisError when the samples are too few or leave the harmonic undetermined.
    """
    if periods < MIN_PERIODS:
        raise AnalysisError(f"only {periods} whole crank periods, {MIN_PERIODS} are needed")
    samples = len(values)
    if samples < MIN_SAMPLES_PER_PERIOD * periods:
        raise AnalysisError(
            f"only {samples} samples in {periods} crank periods, "
            f"{MIN_SAMPLES_PER_PERIOD * periods} are needed"
        )
    if not np.isfinite(values).all():
        raise AnalysisError("a sample is not a number")
    turns = (angle - start_angle) / (2 * np.pi)
    first = periods + _SPLINE_DEGREE  # column of cos θ, behind the spline's
    q, r = np.linalg.qr(_regressors(turns, angle, periods))
    if np.linalg.cond(r) > MAX_CONDITION:
        raise AnalysisError("the gaps between the samples leave the harmonic undetermined")
    coefficients = solve_triangular(r, q.T @ values)
    residuals = values - q @ (q.T @ values)
    cosine, sine = coefficients[first : first + 2]

    # Power of the residuals at the crank frequency against that of unit white noise
    probes = _segment_probes(angle, start_angle, periods)
    probes = probes - q @ (q.T @ probes)
    gram = probes.T @ probes
    unit_white_power = np.trace(gram)
    powers = probes.T @ residuals
    white_variance = float(powers @ powers / unit_white_power)
    dof = float(unit_white_power**2 / np.sum(gram**2))

    inverse_r = solve_triangular(r, np.eye(r.shape[0]))
    gain = np.sum(inverse_r[first : first + 2] ** 2) / 2  # mean of two diagonals of (XᵀX)⁻¹
    residual_variance = float(residuals @ residuals / (samples - r.shape[0]))
    return Harmonic(
        value=complex(cosine, -sine),
        variance=white_variance * gain,
        dof=dof,
        segments=(powers[0::2] - 1j * powers[1::2]) * math.sqrt(2 * gain / unit_white_power),
        residual_rms=math.sqrt(residual_variance),
        samples=samples,
        effective_samples=samples * residual_variance / white_variance
        if white_variance > 0
        else float(samples),
    )


_SPLINE_DEGREE = 3


def _regressors(turns: np.ndarray, angle: np.ndarray, periods: int) -> np.ndarray:
    """B-splines over the crank's turns, then the harmonics: shape (n, periods + 3 + 6)."""
    ends = _SPLINE_DEGREE * [0.0], _SPLINE_DEGREE * [float(periods)]
    knots = np.concatenate((ends[0], np.arange(periods + 1.0), ends[1]))
    # The last sample may lie on the last knot, or a rounding error beyond.
    inside = np.clip(turns, 0.0, np.nextafter(float(periods), 0.0))
    spline = BSpline.design_matrix(inside, knots, _SPLINE_DEGREE).toarray()
    harmonics = [f(k * angle) for k in range(1, HARMONICS + 1) for f in (np.cos, np.sin)]
    return np.column_stack([spline, *harmonics])


def _segment_probes(angle: np.ndarray, start_angle: float, periods: int) -> np.ndarray:
    """Hann-windowed cosine and sine of each segment, as columns: shape (n, 2·(periods − 1))."""
    columns = []
    for number in range(periods - SEGMENT_PERIODS + 1):
        progress = (angle - start_angle) / (2 * np.pi) - number
        inside = (progress >= 0) & (progress <= SEGMENT_PERIODS)
        window = np.where(inside, np.sin(np.pi * progress / SEGMENT_PERIODS) ** 2, 0.0)
        columns += [window * np.cos(angle), window * np.sin(angle)]
    return np.column_stack(columns)
