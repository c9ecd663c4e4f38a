"""The records the law works on, beside the tick: parameters, state, command, friction model.

All are one-row structured arrays (the friction model has one row per axis), handed to compiled
functions as arrays, whose row 0 is the record. Lengths that follow the rig are sub-array shapes, so
one rig size is one compiled version."""
# longer than 300 lines: the law's memory: three tables of fields, each with what it is for

from __future__ import annotations

from functools import cache

import numpy as np

from hw.record_fields import Record as Record  # the modules of the law take it from here
from rtctl.control.environments.table import PARAMETERS

LOCKOUT_FAULTS = 3
"""This many faults within a minute close the rig (`states.LOCKOUT_S`)."""

HISTORY = 64
"""Longest position history of the velocity estimators, samples."""

MAX_SEGMENTS = 1024
"""Most cubic segments of one direction of a compiled friction model."""

LOOKUP_CELLS = 1024
"""Cells of the uniform grid that finds the segment of a speed."""

PLACE_ORDERS = 4
"""Most waves a turn of a friction that differs from place to place."""

PLACE_SEGMENTS = 128
"""Most segments of a curve with place: `rtctl identify` measures 54 speeds."""

CONSERVATIVE_CELLS = 512
"""Cells over one period of the conservative part: 10 for the shortest of its waves."""


LOAD_CELLS = 512
"""Cells of the fall with speed of what a load adds to the peak."""

MARK_WORDS = 16
"""Words of 63 marks each that hold the marks of the last 1000 ticks (`control.window`)."""

HELD = 32
"""Torques sent that are remembered, to compare with what the motor is measured to give."""

RESPONSE = 32
"""Ticks after each step of the test pulse in which the current's answer is kept."""

Shape = tuple[int, ...]


def _record(
    scalars: dict[str, str],
    axis: dict[str, Shape],
    n_axes: int,
    marks: dict[str, int] | None = None,
    vectors: dict[str, Shape] | None = None,
) -> np.dtype[np.void]:
    """Scalars, then integer arrays of the given lengths, arrays of numbers of the given shapes, per-axis
    fields."""
    fields: list[tuple[str, str] | tuple[str, str, Shape]] = [*scalars.items()]
    fields += [(name, "<i8", (length,)) for name, length in (marks or {}).items()]
    fields += [(name, "<f8", shape) for name, shape in (vectors or {}).items()]
    for name, extra in axis.items():
        kind = (
            "<i8"
            if name.endswith(("_kind", "_method", "_policy", "_ticks", "_count", "_side", "_flags"))
            else "<f8"
        )
        fields.append((name, kind, (n_axes, *extra)))
    return np.dtype(fields)


@cache
def params_dtype(n_axes: int) -> np.dtype[np.void]:  # longer than 50 lines: one table of fields
    """Parameters: fixed while the loop runs."""
    return _record(
        {
            "period_s": "<f8",
            "ready_ticks": "<i8",  # good ticks in IDLE before arming is allowed
            "soft_start_ticks": "<i8",  # authority ramp 0 -> 1
            "stop_ticks": "<i8",  # RAMP: applied torque falls to 0 within this many ticks
            "target_hold_ticks": "<i8",  # age of a renderer target that causes HOLD
            "target_stop_ticks": "<i8",  # age that causes STOPPING
            "stale_limit_ticks": "<i8",  # sample age that causes a CUT
            "late_limit_ticks": "<i8",  # late ticks in a row that are an OVERRUN; 0: counted only
            "waiver_share": "<f8",  # share of the torque limit without real-time rights; 0: not armed at all
            "arming_ticks": "<i8",  # one of the four parts of the test pulse
            "window_share": "<f8",  # what one tick counts in the 250 ms window of the gate
            "energy_budget_j": "<f8",  # passivity: deficit tolerated before damping is injected
            "energy_bank_j": "<f8",  # passivity: most energy that may be saved up
            "renderer_store_j": "<f8",  # most energy the renderer may put in at once
            "renderer_power_w": "<f8",  # most power it may put in for ever
            # force sensor (control.wrench, control.force_doubt)
            "force_used": "<i8",  # 1: the rig has one
            "force_answers": "<i8",  # 1: it feels what moves the joint; not so in a recording
            "moment_used": "<i8",  # 1: its moments count
            "moment_limit_nm": "<f8",
            "off_axis_n": "<f8",  # most force across the joints; 0: not watched
            "off_axis_nm": "<f8",
            "chain_count": "<i8",  # joints that turn the sensor
        },
        {
            # plant, link side
            # 1: the coordinate is in m, and what was chosen for a joint is as at a handle (control.handle)
            "is_linear": (),
            "inertia_kgm2": (),
            "viscous_nms_rad": (),  # guaranteed viscous damping of the device, in a motion of all of it
            "sure_viscous_nms_rad": (),  # what of it no hand behind an elastic joint takes away (2.8)
            "gear_ratio": (),
            "gear_efficiency": (),
            "torque_constant_nm_a": (),
            "count_rad": (),  # one encoder count at the link
            # 1: friction surely holds the joint while a flicker of the encoder is not answered
            "flicker_held": (),
            "lever_m": (3,),  # joint torque = lever . tip force + direction . moment, at position 0
            "axis_direction": (3,),  # unit vector of the joint's axis in the sensor's axes; 0: not given
            # sample validation
            "position_min_rad": (),
            "position_max_rad": (),
            "force_limit_n": (),
            "current_limit_a": (),
            # limits
            "torque_limit_nm": (),
            "torque_continuous_nm": (),  # largest mean |torque| over 250 ms
            "torque_rate_nm": (),  # largest change of applied torque per tick
            "velocity_limit_rad_s": (),
            # detectors and test pulse
            "follow_kind": (),  # 1: the measured current must follow the torque sent
            "current_gain_error": (),  # how far the current's gain may be off 1
            "current_overshoot_limit": (),  # how far the current may exceed a step; 0: not asked
            "current_offset_nm": (),  # and how far it may be off besides, as torque
            "follow_delay_ticks": (),  # the measurement may be this much late
            "actuator_delay_ticks": (),  # the torque acts this much late, as far as is known
            "acting_delay_s": (),  # the same to a part of a tick, for the account of the port
            "declared_delay_s": (),  # from a sample to its torque at the motor, as the rig file has it
            "proof_age_ticks": (),  # age of samples that the proof includes beside it
            "proof_delay_s": (),  # up to which the coupling is proven; 0: delay and age are not watched
            "temperature_kind": (),  # 1: the motor has a temperature sensor
            "temperature_warn_c": (),
            "temperature_trip_c": (),
            "arming_torque_nm": (),
            "arming_travel_rad": (),
            # velocity estimator (velocity.Method)
            "velocity_method": (),
            "velocity_window_ticks": (),
            "velocity_band_rad": (),
            "velocity_alpha": (),  # low-pass coefficient per tick
            "kalman_gain_position": (),
            "kalman_gain_velocity": (),  # 1/s
            # velocity measured by a device (control.device_velocity)
            "device_velocity_kind": (),  # vocabulary.DeviceVelocity
            "device_tolerance_rad_s": (),
            # force
            "force_alpha": (),  # low-pass coefficient per tick, 1 = off
            "tare_ticks": (),
            "force_offset_limit_nm": (),  # how far the force may be off in power, as torque
            # virtual coupling
            "coupling_stiffness_nm_rad": (),
            "coupling_damping_nms_rad": (),
            # admittance display (control.virtual_mass)
            "display_kind": (),  # vocabulary.Display
            "display_change": (),  # 1: a command may change the display
            "mass_kgm2": (),  # the least that a command may ask for, as the next line
            "mass_damping_nms_rad": (),
            "mass_max_kgm2": (),  # and the most
            "mass_damping_max_nms_rad": (),
            "mass_forward": (),  # share of the torque that the mass's motion alone asks of the joint
            "mass_compensation": (),  # share of the help with friction while the mass is shown
            "mass_forward_alpha": (),  # low-pass coefficient per tick of it
            "mass_force_alpha": (),  # low-pass coefficient per tick
            "mass_force_deadband_nm": (),
            "mass_rest_nms_rad": (),  # damping while the joint sticks, beyond a low-pass of the next line
            "mass_rest_alpha": (),
            # low-pass coefficient of the force while the joint is not seen (control.flicker.is_blind),
            "mass_blind_alpha": (),
            "mass_blind_nms_rad": (),  # and the damping of the mass
            "mass_rest_rad": (),  # length of the bristles by which it sticks; 0: it never does
            "servo_velocity_gain_nms_rad": (),
            "servo_position_gain_nm_rad": (),
            "watch_floor_nm": (),  # force that may ring without being damped
            "servo_velocity_alpha": (),  # low-pass coefficient per tick
            # friction feed-forward (feedforward.Policy)
            "friction_policy": (),
            "friction_gain": (),  # kappa, Coulomb and Stribeck part
            "friction_viscous_gain": (),  # kappa_v
            "friction_load_gain": (),  # share of what the load adds; 0: the law does not go by load
            "friction_cap_nm": (),  # hard cap of |feed-forward|
            # gain and caps are greater by this share, for a friction that is: control.friction_factor
            "friction_raise": (),
            # how far sliding may be off the model, for the drift watch; 0: as the floor says
            "friction_sliding_doubt_nm": (),
            # and where it goes by place, as far as the place is trusted; 0: likewise
            "friction_place_doubt_nm": (),
            # most by which that may change in a tick; 0: the friction is as learned
            "friction_change_step": (),
            "friction_ungated_cap_nm": (),  # cap where the force gate does not open it: kappa * min Fhat
            "friction_tanh_rad_s": (),
            "friction_blend_rad_s": (),
            "friction_deadband_rad_s": (),
            "friction_dither_ticks": (),  # period of the dither in ticks
            "friction_intent_nm": (),  # tau_g of the force intent: saturation of the sign
            "friction_intent_alpha": (),  # low-pass coefficient per tick of the force intent
            "rest_alpha": (),  # of what follows the hand's torque after a long rest (control.resting)
            "friction_gate_deadband_nm": (),
            "friction_gate_nm": (),  # tau_g of the force gate
            "friction_gate_alpha": (),
            # against the motion, beyond the dead band: takes all help back; 0: nothing does
            "friction_brake_nm": (),
            # friction by which a hand pays for help, and by which help feeds a vibration; 0: neither is asked
            "paying_nm": (),
            "tremble_turn_s": (),  # longest time between two turns of a joint that trembles; 0: none does
            "friction_stop_rad": (),  # x_d of the stop operator
            # dry friction surely there (control.dry_friction), account of the help with it
            # (control.assistance)
            "presliding_rad": (),  # x_b: bristles surely slide after this much motion; 0: at once
            # low-pass coefficient per tick of the friction seen in sliding; 0: not used
            "friction_seen_alpha": (),
            "friction_seen_max_nm": (),  # most of it that is believed
            "assistance_bank_j": (),
            # friction over position (control.place_trust)
            "place_kind": (),  # vocabulary.PlaceUse
            "place_shift_rad": (),  # position where the model has its 0
            "place_trough_nm": (),  # friction at the weakest place is so far below the curve
            "place_length_rad": (),  # way over which it is judged
            "place_speed_rad_s": (),  # faster waves are not seen by the observer
            # 1: its waves are slow enough to be seen, and are judged with those of friction
            "conservative_judged": (),
            "conservative_gain": (),  # 0: off
            "conservative_swing_j": (),  # most that the compensated spring gives back
            # disturbance observer (control.disturbance_observer)
            "observer_gain": (),  # 0: only watches
            "observer_alpha": (),  # low-pass coefficient per tick; 0: off
            "observer_smooth_alpha": (),  # of the quicker low-pass before it
            "observer_bandwidth_rad_s": (),
            "observer_deadband_nm": (),
            # by which it delays torque and velocity, to belong to a force that comes late
            "observer_late_ticks": (),
            # share by which it takes the inertia too high, for a force that may come less late
            "observer_excess": (),
            # passivity
            "injected_damping_max_nms_rad": (),
            "friction_floor_nm": (),  # guaranteed dry friction credited by the observer
            "hold_damping_nms_rad": (),
            # local force feedback (control.force_feedback)
            "force_feedback_gain": (),  # 0: off
            "force_feedback_alpha": (),  # low-pass coefficient per tick
            "force_feedback_deadband_nm": (),
            "force_feedback_cap_nm": (),
            "force_feedback_share": (),  # of what friction and spare damping surely take out
            "force_feedback_damping_nms_rad": (),  # device damping that the coupling does not need
            "force_feedback_reserve_nm": (),  # friction that the quantised coupling needs
        },
        n_axes,
        {"chain_axis": n_axes},  # the joints that turn the sensor, from the base on
        {
            "tip_weight_n": (6,),  # force of gravity on the tip at position 0, sensor axes; the rest is room
            "tip_center_m": (3,),
            "force_step": (2,),  # coarsest step of force and moment, N and N m
        },
    )


@cache
def state_dtype(n_axes: int) -> np.dtype[np.void]:  # longer than 50 lines: one table of fields
    """State of the law between two ticks. All zero is the state before the first tick."""
    return _record(
        {
            "ticks": "<i8",  # ticks the law has run
            "state": "<i8",
            "epoch": "<i8",
            "ticks_in_state": "<i8",
            "good_ticks": "<i8",
            "authority": "<f8",
            "faults": "<u8",
            "fault_first": "<i8",
            "sample_count": "<i8",
            "sample_age_ticks": "<i8",
            "late_ticks": "<i8",
            "missed_ticks": "<i8",
            "arm_seen": "<i8",
            "stop_seen": "<i8",
            "reset_seen": "<i8",
            "tare_seen": "<i8",
            "target_seen": "<i8",
            "target_age_ticks": "<i8",
            "beat_seen": "<i8",
            "beat_age_ticks": "<i8",  # ticks run since the host's last sign of life
            # ticks for which the command has had a remote environment, this one counted
            "remote_ticks": "<i8",
            "clear_ticks": "<i8",  # ticks in FAULT without any fault present
            "stop_target": "<i8",  # state that STOPPING ends in
            "fault_total": "<i8",  # faults so far
            "late_count": "<i8",  # late ticks among the last 1000
            "checksum_count": "<i8",  # damaged frames among them
            "old_count": "<i8",  # samples older than the proof covers among them
            "lease": "<i8",  # nonce of the renderer that may send targets; 0: none
            "targets_refused": "<i8",
            "same_ticks": "<i8",  # ticks for which the force has not changed by one bit
            "clipped_ticks": "<i8",  # samples in a row at a limit
            "across_ticks": "<i8",  # samples in a row with too much across the joints
        },
        {
            "position_rad": (),
            "position_before_rad": (),
            "reading_rad": (),  # the encoder's newest count, and which way it went there (control.flicker)
            "reading_way": (),
            "reading_from_rad": (),  # where the readings began among which it stays,
            "reading_lowest_rad": (),
            "reading_highest_rad": (),
            "reading_still_ticks": (),  # since the reading changed,
            "reading_turns": (),  # how often it turned there,
            "reading_sum_rad": (),  # and the sum and the number of readings since the first turn
            "reading_ticks": (),
            "reading_held_rad": (),  # what is taken for the position meanwhile
            "reading_gap_rad": (),  # and what is left of the difference since
            "current_a": (),
            "force_raw_nm": (),
            "position_history_rad": (HISTORY,),
            "history_count": (),
            "velocity_rad_s": (),
            "kalman_position_rad": (),
            "kalman_velocity_rad_s": (),
            # travel by the device's velocity less the encoder's, forgotten over a window
            "device_gap_rad": (),
            "device_doubt_ticks": (),  # implausible samples in a row
            "force_filtered_nm": (),
            "hand_torque_before_nm": (),  # hand torque of the tick before, for the energy of the hand
            "tare_sum": (6,),  # of force and moment, less the weight
            "tare_count": (),
            "tare": (6,),
            "screw": (6,),  # lever and direction at the last sample's pose
            # doubts about the force (control.force_doubt)
            "unseen_start_rad": (),  # where the joint was when the force began to stay
            "unseen_j": (),  # energy that nobody shown has given since then
            "unseen_path_rad": (),
            "slid_ticks": (2,),  # since powered, forward and backward
            "stayed_ticks": (2,),  # of them since the force began to stay
            "slid_friction_nm": (2,),  # mean friction of a second of sliding, forward and backward
            "offset_ticks": (),  # for which the force has been off
            "proxy_position_rad": (),
            "proxy_set_count": (),
            # admittance display (control.virtual_mass); the mass is at proxy_position_rad
            "display_kind": (),  # in force
            "display_faded": (),  # share of it that is not felt, as it changes
            "mass_kgm2": (),  # in force
            "mass_damping_nms_rad": (),
            "mass_velocity_rad_s": (),
            "mass_force_nm": (),  # hand torque, low-passed
            "mass_forward_nm": (),  # torque that the mass's motion asks of the joint, low-passed
            "mass_bristle_share": (),  # where the joint is within its bristles, -1..1
            "mass_calm_rad_s": (),  # velocity of the mass, low-passed, while the joint sticks
            "mass_calms_nms_rad": (),  # the damping of it
            "mass_injected_nms_rad": (),  # damping added by the passivity controller
            "servo_velocity_rad_s": (),  # of the joint, low-passed
            "mass_watch_nms_rad": (),  # and by the watch on its stability (control.stability_watch)
            "watch_low_nm": (),  # hand torque below the band where hands do not act
            "watch_fast_nm2": (),  # its powers in that band and below
            "watch_slow_nm2": (),
            "watch_s": (),  # for which it has rung
            "watch_share": (),
            "remote_position_rad": (),  # the renderer's end of the spring to the mass
            "friction_gate": (),
            "friction_push_nm": (),  # torque of hand and coupling that the brake goes by (control.pace)
            # mean of the hand's torque, which opens the gate while the joint slides on
            "friction_mean_hand_nm": (),
            "pace_rad_s": (),  # mean speed of the last tenths of a second
            "friction_brake": (),  # share of the help that a hand which brakes the joint takes back, 0..1
            # strokes that shrink (control.shrinking)
            "stroke_peak_rad_s": (),  # largest speed of the present stroke
            "stroke_reference_rad_s": (),  # of those before
            "stroke_side": (),  # its direction, -1 or 1; 0: none yet
            "stroke_s": (),  # for which it has moved
            "stroke_before_s": (),  # and did in the stroke before
            "stroke_wanted": (),  # share of the help that is to be taken back, and what is
            "stroke_left": (),
            "turn_rad": (),  # as far as the joint has gone since it last turned (control.trembling)
            "turn_from_rad": (),  # where that was
            "turn_s": (),  # time since then
            "turned": (),  # 1: it moves backward
            "trembled_s": (),  # for which it turned more often than a hand can
            "fed_j": (),  # account of what the observer feeds to a vibration (control.feeding)
            "fed_rad_s": (),  # low-passes of velocity and observer
            "fed_nm": (),
            "fed_sent_nm": (HELD,),  # the observer's torque sent, ring by `ticks`
            "fed_slid_s": (),  # for which it has slid in one direction, and that
            "fed_side": (),
            "fed_standing_j": (),  # counted in one place, which counts once it goes on the same way
            "paid_j": (),  # account of what is paid for friction (control.paying)
            "paid_left": (),  # share of the help that is left
            "paid_rad": (),  # motion, speed, and torque of world and injected damping of the sample before
            "paid_rad_s": (),
            "paid_push_nm": (),
            "friction_stop": (),  # stop operator state, -1..1
            "friction_load_nm": (),  # what the load adds to the friction
            "friction_intent_nm": (),  # hand torque, low-passed for the intent
            "rest_position_rad": (),  # where the joint was when it last moved on
            "rest_ticks": (),  # ticks since then
            "bent_ticks": (),  # ticks since it last slid
            "calm_hand_nm": (),  # hand torque, low-passed while the joint rests
            "calm_world_nm": (),  # and that of the coupling
            "bristle_share": (),  # h: deflection of the credited bristles over their length, -1..1
            "friction_credit_j": (),  # what dry friction took out in the last period
            "friction_seen_nm": (2,),  # friction seen in sliding, forward and backward
            "friction_observed_nm": (),
            # acting and hand's torque after the quick low-pass, then after both
            "observer_torque_smooth_nm": (),
            "observer_torque_nm": (),
            "observer_velocity_smooth_rad_s": (),
            "observer_velocity_rad_s": (),
            "observer_moved_rad_s": (HELD,),  # difference velocity, ring by `ticks`
            "observer_forward_nm": (),  # feed-forward through the slow low-pass
            # that the feed-forward goes by: while the joint rests the largest of late
            "calm_speed_rad_s": (),
            "reading_slip_rad": (),  # of the position in this sample that was no motion (control.flicker)
            "observer_end": (),  # how near the bristles were to their end when the joint last moved on, 0..1
            "observer_left": (),  # share of it that a slow hand is left
            "mass_helped_share": (),  # share of it that is sent: 1, none where a virtual mass is shown
            "assistance_energy_j": (2,),  # accounts of the compensation: torque in time, and one tick later
            "compensation_nm": (HELD,),  # feed-forward and observer torque sent, ring by `ticks`
            "friction_change": (),  # of the learned friction, that the feed-forward goes by: factor less 1
            # friction over position (control.place_trust)
            "place_evidence": (),  # for SEEN, against GIVEN, 0 to 1
            # what the model says of speed and of place, as late as the observer shows it
            "place_model_nm": (2,),
            "place_way": (),  # way judged over, share of its length
            "place_mean_nm": (
                2,
                2,
            ),  # of friction seen beyond the curve and of the model's, forward and backward
            "place_square_nm2": (3,),  # spread of both, and of both together
            "conservative_nm": (),  # share of the feed-forward that is the conservative part's
            "torque_applied_nm": (),
            "feedforward_applied_nm": (),
            "ramp_step_nm": (),
            "energy_port_j": (),
            "stored_energy_j": (),  # in the coupling and the environment: returned, so never capped
            # environment in force, on its way to the command's (environments.changes)
            "world_kind": (),
            **{f"world_{one.name}": () for one in PARAMETERS},
            "renderer_store_j": (),  # energy that changes of the environment may still put in
            "renderer_grant_j": (),  # put in by this tick's
            "authority_grant_j": (),  # put in by the last rise of the authority, as far as it was paid
            "energy_hand_j": (),
            "energy_feedforward_j": (),
            "jump_count": (),
            "target_position_rad": (),  # the lease holder's last
            "target_velocity_rad_s": (),
            # detectors, gate and test pulse
            "held_nm": (HELD,),  # torques sent, ring by `ticks`
            "lag_ticks": (),
            "cold_ticks": (),  # ticks without a temperature
            "heat_share": (),
            "window_mean_nm": (),
            "test_start_rad": (),
            "test_pulse_rad": (),
            "test_moved_rad": (),
            "test_product_nm2": (),
            "test_square_nm2": (),
            "test_hand_nm": (),
            # answer of the current to the test pulse (control.current_answer)
            "answer_sent_nm": (RESPONSE,),  # torque sent after the steps, laid over one another
            "answer_measured_nm": (RESPONSE,),
            "answer_model_nm": (RESPONSE,),
            "answer_before_nm": (),  # torque sent before the steps
            "answer_gap_nm": (),  # sum of measured minus sent
            "answer_rest_nm": (),  # sum of measured before the first step, and of its square
            "answer_rest_nm2": (),
            "answer_late_count": (),  # slots skipped in between: nothing can be said
            "answer_count": (),  # 1: measured
            "answer_delay": (),  # ticks
            "answer_lag": (),  # ticks
            "answer_gain": (),
            "answer_offset_nm": (),
            # delay while running (control.running_delay)
            "running_sent_nm": (),  # low-passed
            "running_measured_nm": (),
            "running_sums": (9,),
            "running_ticks": (),  # of the present window
            "running_count": (),  # 1: measured
            "running_bad_count": (),  # windows in a row that leave the proof
            "running_delay": (),  # ticks
            "running_gain": (),
            "running_offset_nm": (),
            "running_gap_count": (),  # windows in a row in which the current is not the one asked for
            "running_known_count": (),  # 1: gain and offset measured
            # excitation program
            "program_kind": (),
            "program_flags": (),
            "program_seen_count": (),
            "program_ticks": (),  # ticks since it started
            "program_start_rad": (),
            "program_reference_rad": (),
            "program_speed_rad_s": (),  # reference speed
            "program_velocity_rad_s": (),  # the program's own estimate
            "program_ramp_nm": (),
            "program_integral_nm": (),
            # local force feedback
            "force_error_nm": (),  # hand torque beyond the desired one, low-passed
            "force_feedback_nm": (),  # torque of the feedback
            "force_feedback_energy_j": (),  # account of the assistance
            "assistance_nm": (HELD,),  # feed-forward and feedback sent, ring by `ticks`
        },
        n_axes,
        {
            "late_marks": MARK_WORDS,
            "checksum_marks": MARK_WORDS,
            "old_marks": MARK_WORDS,
            "fault_tick": LOCKOUT_FAULTS,
        },
        {
            "wrench": (6,),  # force and moment of the last valid sample
            "wrench_before": (6,),
            "wrench_step": (2,),  # smallest change seen of force and of moment
            "weight": (6,),  # of the tip, at its pose
            "tared": (6,),
            "beside_basis": (3, 3),  # room for `wrench.beside`
            "beside_rest": (3,),
        },
    )


@cache
def command_dtype(n_axes: int) -> np.dtype[np.void]:  # longer than 50 lines: one table of fields
    """The newest command: what the host asks of the loop. Counters make edges that cannot be lost.

    A rise of `arm_count`, `stop_count`, `reset_count`, `tare_count` is one request; a rise of
    `target_count` is a fresh renderer target. A rise of `beat_count` is a sign of life of the host, which
    promises the next one within `beat_ticks` ticks; 0 promises nothing."""
    return _record(
        {
            "seq": "<i8",
            "stamp_ns": "<i8",
            "epoch": "<i8",
            "arm_count": "<i8",
            "stop_count": "<i8",
            "reset_count": "<i8",
            "tare_count": "<i8",
            "shutdown_count": "<i8",
            "beat_count": "<i8",
            "beat_ticks": "<i8",
            "target_count": "<i8",
            "target_epoch": "<i8",  # epoch the target was made for
            "target_lease": "<i8",  # nonce of whoever sent it; 0 holds no lease
        },
        {
            "environment_kind": (),  # environments.table.Environment
            **{f"environment_{one.name}": () for one in PARAMETERS},
            "target_position_rad": (),
            "target_velocity_rad_s": (),
            "compensation": (),  # 0..1
            # of the learned friction: factor less 1; outside what is allowed: the nearest that is
            "friction_change": (),
            "display_kind": (),  # vocabulary.Display
            # of the virtual mass; outside what the rig file allows: the nearest that it does
            "mass_kgm2": (),
            "mass_damping_nms_rad": (),
            # excitation program (control.program): starts at a rise of `program_count`
            "program_count": (),
            "program_kind": (),  # vocabulary.Program
            "program_limit_ticks": (),  # it ends after this long whatever happens
            "program_velocity_rad_s": (),
            "program_acceleration_rad_s2": (),
            "program_stiffness_nm_rad": (),
            "program_damping_nms_rad": (),
            "program_alpha": (),  # low-pass coefficient per tick of its velocity
            "program_torque_max_nm": (),
            "program_ramp_nm_s": (),  # signed
            "program_fast_nm": (),  # below this the ramp is quicker
            "program_slip_rad": (),  # RAMP: displacement that ends it; TRACK: error that does
            "program_shape": (),  # vocabulary.Shape
            "program_amplitude_rad": (),  # signed
            "program_rate": (),  # SINE: rad/s of its phase; TRIANGLE: rad/s
            "program_integral_nm_rad_s": (),
            "program_inertia_kgm2": (),
            "program_friction_gain": (),
            "program_error_rad": (),  # error at which the friction of a standing reference is taken in full
            "program_min_rad": (),  # travel
            "program_max_rad": (),
            "program_hand_nm": (),  # largest |hand torque - zero|
            "program_hand_zero_nm": (),
        },
        n_axes,
    )


MODEL = np.dtype(
    [
        # index 0: v >= 0, index 1: v < 0; argument is |v| in rad/s, value the friction magnitude in N m
        ("n_segments", "<i8", (2,)),
        ("knot_rad_s", "<f8", (2, MAX_SEGMENTS + 1)),
        ("coefficient", "<f8", (2, MAX_SEGMENTS, 4)),
        ("lookup", "<i4", (2, LOOKUP_CELLS)),
        ("lookup_scale", "<f8", (2,)),  # cells per rad/s
        ("speed_max_rad_s", "<f8", (2,)),  # end of the trained range
        ("speed_fade_rad_s", "<f8", (2,)),  # the feed-forward fades to 0 over this much beyond it
        ("friction_min_nm", "<f8", (2,)),  # least dry friction (viscous part removed) over the range
        ("viscous_nms_rad", "<f8", (2,)),  # viscous slope contained in the model
        # friction over position (control.place_friction): cos and sin of each order, on the knots above
        ("place_orders", "<i8", (2,)),  # 0: place adds nothing
        ("place_turns_per_rad", "<f8"),  # turns per rad of the joint
        ("place_coefficient", "<f8", (2, PLACE_SEGMENTS, 2 * PLACE_ORDERS, 4)),
        # conservative part: a cubic over each cell of a period, by the share of the cell
        ("conservative_per_rad", "<f8"),  # periods per rad of the joint; 0: none
        ("conservative", "<f8", (CONSERVATIVE_CELLS, 4)),
        # what the torque through the gear adds (control.load_friction); the fields of `friction.load.Load`
        ("load_outside", "<f8"),
        ("load_motor", "<f8"),
        ("load_outside_peak", "<f8"),
        ("load_motor_peak", "<f8"),
        ("load_outside_square_per_nm", "<f8"),
        ("load_motor_square_per_nm", "<f8"),
        ("load_fall", "<f8", (LOAD_CELLS + 1,)),  # of the peak, even over the fourth root of the speed
        ("load_cells_s_rad", "<f8"),  # cells^4 for each rad/s
        ("load_most_nm", "<f8"),  # largest torque that was measured; 0: load adds nothing
    ]
)
"""Compiled friction model of one axis: piecewise cubics with a uniform look-up of the segment."""


def new_records(n_axes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Zeroed (params, state, command, model) for a rig of `n_axes` axes."""
    return (
        np.zeros(1, params_dtype(n_axes)),
        np.zeros(1, state_dtype(n_axes)),
        np.zeros(1, command_dtype(n_axes)),
        np.zeros(n_axes, MODEL),
    )
