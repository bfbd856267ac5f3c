"""Cams and plungers: equations (20) and (21), work of springs, masses and fuel, contact."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import given, refused

from gensig.driveline.excitation.cams import Cam, cam_torque, follower_force
from gensig.driveline.excitation.injection_pump import Plunger, plunger_torque
from gensig.errors import ConfigError

VALVE = Cam(
    follower="flat",
    lift=0.012,
    span=np.radians(140),
    base_radius=0.04,
    roller_radius=0.0,
    moving_mass=3.0,
    spring_preload=1500.0,
    spring_rate=6e4,
    friction_coefficient=0.1,
)
PUMP_CAM = replace(
    VALVE,
    follower="roller",
    lift=0.014,
    span=np.radians(120),
    base_radius=0.025,
    roller_radius=0.015,
    moving_mass=0.8,
    spring_preload=600.0,
    spring_rate=3e4,
    friction_coefficient=0.0,
)
PLUNGER = Plunger(
    cam=PUMP_CAM,
    diameter=0.015,
    delivery_pressure=80e6,
    opening_pressure=25e6,
    ramp_share=0.25,
    delivery_begin=np.radians(-16),
    lift_at_delivery=0.003,
    fuel_density_kg_per_m3=840.0,
    heating_value_j_per_kg=42.7e6,
    indicated_efficiency=0.48,
)
ANGLE = np.linspace(0.0, 2.0 * np.pi, 7200, endpoint=False)
SPEED, VOLUME = 88.4, 510e-9


def test_lift_slope_and_curvature_belong_together():
    lift, slope, curvature = VALVE.motion(ANGLE)
    step = ANGLE[1]
    assert_allclose(lift.max(), 0.012, rtol=1e-6)
    assert_allclose(
        np.gradient(lift, step)[1:-1],
        slope[1:-1],
        rtol=0,
        atol=1e-4 * np.abs(slope).max(),
    )
    inside = (ANGLE > 0.05) & (VALVE.span - 0.05 > ANGLE)
    assert_allclose(
        np.gradient(slope, step)[inside],
        curvature[inside],
        rtol=0,
        atol=1e-3 * np.abs(curvature).max(),
    )
    assert np.max(np.abs(np.diff(curvature))) < 0.02 * np.ptp(
        curvature
    )  # no jump: no jerk without end
    assert not np.any(lift[VALVE.span < ANGLE])


def test_spring_and_mass_do_no_work_over_a_turn():
    torque = cam_torque(replace(VALVE, friction_coefficient=0.0), ANGLE, SPEED)
    assert np.ptp(torque) > 30.0
    assert abs(torque.mean()) < 1e-6 * np.ptp(torque)


def test_friction_takes_its_force_on_the_lever_of_the_contact():
    force = follower_force(VALVE, ANGLE, SPEED)
    lift, slope, _ = VALVE.motion(ANGLE)
    torque = cam_torque(VALVE, ANGLE, SPEED)
    assert_allclose(
        -torque, force * slope + 0.1 * force * (lift + 0.04), rtol=1e-12
    )  # eq. (20)
    assert torque.mean() < 0.0


def test_equation_21_is_force_times_slope():
    lift, slope, _ = PUMP_CAM.motion(ANGLE)
    force = follower_force(PUMP_CAM, ANGLE, SPEED)
    center = 0.025 + 0.015 + lift  # r0 + r1 + h
    pressure_angle = np.arctan2(slope, center)
    assert_allclose(
        -cam_torque(PUMP_CAM, ANGLE, SPEED),
        force * center * np.tan(pressure_angle),
        rtol=1e-12,
        atol=1e-9,
    )


def test_a_follower_that_leaves_its_cam_is_refused():
    fast = 3.0 * SPEED
    with refused(
        "the follower leaves its cam at 2532 r/min of the camshaft: the spring lacks"
    ):
        cam_torque(VALVE, ANGLE, fast)
    assert cam_torque(replace(VALVE, spring_preload=12e3), ANGLE, fast).min() < 0.0


@pytest.mark.parametrize("speed_share", [0.3, 1.0])
def test_a_stroke_takes_the_work_of_the_fuel_pressed_out(speed_share):
    torque = plunger_torque(PLUNGER, ANGLE, SPEED, VOLUME, speed_share)
    peak = max(80e6 * speed_share**2, 25e6)
    share = np.linspace(0.0, 1.0, 10_001)
    shape = (
        np.sin(0.5 * np.pi * np.clip(np.minimum(share, 1.0 - share) / 0.25, 0.0, 1.0))
        ** 2
    )
    assert_allclose(
        -2.0 * np.pi * torque.mean(), peak * VOLUME * shape.mean(), rtol=2e-3
    )


def test_delivery_begins_at_the_stated_lift_and_ends_with_the_fuel():
    with_fuel = plunger_torque(PLUNGER, ANGLE, SPEED, VOLUME, 1.0)
    without = plunger_torque(PLUNGER, ANGLE, SPEED, 0.0, 1.0)
    pressed = ANGLE[with_fuel < without - 1.0]
    lift = PUMP_CAM.motion(pressed + PLUNGER.lead)[0]
    assert pressed.min() < 0.02
    assert_allclose(lift.min(), 0.003, atol=2e-4)
    assert_allclose(lift.max() - 0.003, VOLUME / PLUNGER.area, rtol=0.05)


def test_peak_is_pressure_times_area_times_slope():
    torque = plunger_torque(PLUNGER, ANGLE, SPEED, VOLUME, 1.0) - plunger_torque(
        PLUNGER, ANGLE, SPEED, 0.0, 1.0
    )
    steepest = PUMP_CAM.motion(ANGLE)[1].max()
    assert -torque.min() <= 80e6 * PLUNGER.area * steepest * (1.0 + 1e-9)
    assert -torque.min() > 0.95 * 80e6 * PLUNGER.area * steepest


def test_fuel_that_the_plunger_cannot_deliver_is_refused():
    with pytest.raises(
        ConfigError,
        match=r"3000 mm3 of fuel need 16.98 mm of the plunger .* the cam lifts 14 mm",
    ):
        plunger_torque(PLUNGER, ANGLE, SPEED, 3e-6, 1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    {
        "follower='round'": "cam.follower = 'round'; allowed: flat, roller",
        "lift=0.0": "cam.lift_mm = 0 must be positive",
        "span=7.0": "cam.span_deg = 401.07 must be at most a turn",
        "spring_rate=-1.0": "cam.spring_rate_n_per_m = -1 must not be negative",
        "friction_coefficient=1.5": "cam.friction_coefficient = 1.5 must lie in 0..1",
        "roller_radius=0.01": "cam.roller_radius_mm = 10 with follower = flat",
        "follower='roller'": "cam.roller_radius_mm = 0 with follower = roller",
    }.items(),
)
def test_cams_that_cannot_be_are_refused(change, message):
    with refused(message):
        replace(VALVE, **given(change))


@pytest.mark.parametrize(
    ("change", "message"),
    {
        "diameter=0.0": "injection_pump.diameter_mm = 0 must be positive",
        "opening_pressure=-1e6": "injection_pump.opening_pressure_mpa = -1 must be positive",
        "ramp_share=0.6": "injection_pump.ramp_share = 0.6 must be above 0 and at most 0.5",
        "indicated_efficiency=1.0": (
            "injection_pump.indicated_efficiency = 1 must lie between 0 and 1"
        ),
        "lift_at_delivery=0.014": (
            "injection_pump.lift_at_delivery_mm = 14 must be at least 0 and below"
        ),
    }.items(),
)
def test_plungers_that_cannot_be_are_refused(change, message):
    with refused(message):
        replace(PLUNGER, **given(change))
