"""A machine by its healthy recordings, and the judgement of other recordings of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnose.detection.answer import answer_of
from diagnose.detection.block_features import layout_of
from diagnose.detection.finding import Finding
from diagnose.detection.followed_shafts import FollowedRecording, follow_shafts
from diagnose.detection.gear_stages import GearStages
from diagnose.detection.held_back import (
    Judge,
    References,
    assumed_judge,
    make_judge,
)
from diagnose.detection.same_machine import check_alike, check_healthy
from diagnose.detection.time_blocks import BlockedRecording, block_turns, cut_blocks
from gensig.errors import ConfigError
from gensig.signals.recording import Recording

FALSE_ALARMS = 0.05
# Levels are compared where a healthy recording has the speed within this share; farther off a mesh
# passes from one flank of a resonance to the other. Assumed.
SAME_SPEED = 0.02
LOOSER = 2.0  # limit at other speeds; assumed


@dataclass(frozen=True, slots=True, kw_only=True)
class HealthyMachine:
    """A machine by its healthy recordings.

    Attributes
    ----------
    stages : of its gears
    first : the first healthy recording, as it was followed
    references : all healthy recordings
    turns : of the slowest shaft in a time block
    with_levels, without_levels : judges by all features, and by those that speed, load and
        mounting leave alone
    is_one_session : True for a single healthy recording
    """

    stages: GearStages
    first: FollowedRecording
    references: References
    turns: float
    with_levels: Judge
    without_levels: Judge
    is_one_session: bool

    @classmethod
    def fit(
        cls,
        recordings: Sequence[Recording],
        stages: GearStages,
        speed_rpm: float,
        *,
        mounting: Sequence[Recording] = (),
        false_alarms: float = FALSE_ALARMS,
    ) -> HealthyMachine:
        """Learn a machine from healthy recordings, whose speed is followed by the mesh.

        Parameters
        ----------
        recordings : of one rate and the same channels
        stages : gear pairs, of `diagnose.detection.gear_stages.stages_of`
        speed_rpm : r/min    of the input shaft, within 3 % in every recording
        mounting : healthy too, after the sensor was taken off and mounted again, one each
        false_alarms : share of healthy recordings that may be called changed

        Raises
        ------
        ConfigError    for recordings that are too short, show no mesh, or are not of one machine
        """

        def followed(kind: str, chosen: Sequence[Recording]) -> list[FollowedRecording]:
            return [
                follow_shafts(one, stages, speed_rpm, name=f"{kind} {number}")
                for number, one in enumerate(chosen, start=1)
            ]

        return cls.fit_followed(
            followed("healthy recording", recordings),
            stages,
            mounting=followed("mounting", mounting),
            false_alarms=false_alarms,
        )

    @classmethod
    def fit_followed(
        cls,
        recordings: Sequence[FollowedRecording],
        stages: GearStages,
        *,
        mounting: Sequence[FollowedRecording] = (),
        false_alarms: float = FALSE_ALARMS,
        shortest: FollowedRecording | None = None,
    ) -> HealthyMachine:
        """As `fit`, from recordings over the angle.

        Parameters
        ----------
        shortest : recording that shall be judged, where it may be shorter than all others

        Raises
        ------
        ConfigError    as `fit`
        """
        if not recordings:
            raise ConfigError("--healthy needs at least one recording")
        if not 0.0 < false_alarms < 0.5:
            raise ConfigError(
                f"--false-alarms {false_alarms:g} must lie between 0 and 0.5"
            )
        everything = [*recordings, *mounting]
        check_healthy(everything)
        turns = [one.n_turns * stages.slowest for one in everything]
        if shortest is not None:
            turns.append(shortest.n_turns * stages.slowest)
        is_one_session = len(everything) == 1
        length = block_turns(turns, is_one_session=is_one_session)
        speeds = [one.speed_rpm for one in everything]
        first = recordings[0]
        layout = layout_of(
            stages, first.sensors, first.sampling_rate, (min(speeds), max(speeds))
        )
        blocked = [cut_blocks(one, length, layout) for one in everything]
        if is_one_session:
            blocked = blocked[0].halves()
        references = References(
            recordings=tuple(blocked),
            n_mountings=len(mounting),
            layout=layout,
            is_remounted=bool(mounting),
        )
        shape = np.array([not feature.is_level for feature in references.features])
        judge = make_judge
        if is_one_session:
            judge = assumed_judge
        alone = _known(references, is_one_session)
        return cls(
            stages=stages,
            first=first,
            references=references,
            turns=length,
            with_levels=judge(references, alone, false_alarms),
            without_levels=judge(references, alone & shape, false_alarms),
            is_one_session=is_one_session,
        )

    def judge(
        self,
        recording: Recording,
        speed_rpm: float | None = None,
        *,
        name: str = "recording",
        other_load: bool = False,
    ) -> Finding:
        """Judge a recording whose speed is followed by the mesh.

        Parameters
        ----------
        recording : of the rate and channels of the healthy ones
        speed_rpm : r/min    of the input shaft, within 3 %; default: that of the healthy ones
        name : for the answer
        other_load : True where the load differs from the healthy recordings': levels do not count

        Raises
        ------
        ConfigError    for a recording that is too short, shows no mesh, or has another rate or
            other channels
        """
        speed = speed_rpm or self.first.speed_rpm
        followed = follow_shafts(recording, self.stages, speed, name=name)
        return self.judge_followed(followed, other_load=other_load)

    def judge_followed(
        self, followed: FollowedRecording, *, other_load: bool = False
    ) -> Finding:
        """As `judge`, for a recording over the angle."""
        check_alike(followed, self.first)
        own = cut_blocks(followed, self.turns, self.references.layout)
        far = self._speed_difference(own)
        with_levels = far <= SAME_SPEED and not other_load
        judge = self.with_levels if with_levels else self.without_levels
        if far > SAME_SPEED:
            judge = judge.looser(LOOSER)
        finding = answer_of(followed, own, self.references, judge)
        return replace(finding, notes=(*self._notes(far, other_load), *finding.notes))

    def _speed_difference(self, recording: BlockedRecording) -> float:
        """Relative difference of the speed from that of the nearest reference."""
        return min(
            abs(recording.speed_rpm / other.speed_rpm - 1.0)
            for other in self.references.recordings
        )

    def _notes(self, far: float, other_load: bool) -> tuple[str, ...]:
        """Limits of an answer that follow from the healthy recordings."""
        notes = []
        threshold = self.with_levels.threshold
        share = f"{threshold.false_alarms:.0%}"
        kind = "mountings" if self.references.is_remounted else "healthy recordings"
        if self.is_one_session:
            notes.append(
                "one healthy recording shows the time blocks of one session alone: spread between "
                f"sessions and the limit for {share} false alarms are assumed"
            )
        elif threshold.is_rank:
            notes.append(
                f"at most {share} false alarms if this recording is exchangeable with the "
                f"{threshold.n_held_back} {kind}"
            )
        else:
            n_known = threshold.n_held_back
            notes.append(
                f"{n_known} held-back {kind} promise no fewer than "
                f"{1.0 / (n_known + 1):.0%} false alarms by rank; the limit for {share} assumes a "
                "distribution of their scores"
            )
        if far > SAME_SPEED:
            notes.append(
                f"speed {far:.1%} from the nearest healthy recording: levels are not compared, "
                f"shapes alone, with a limit {LOOSER:g} times as wide"
            )
        elif other_load:
            notes.append("other load: levels are not compared, shapes alone")
        return tuple(notes)


def _known(references: References, is_one_session: bool) -> NDArray[np.bool_]:
    """(feature,) True for those that the references can calibrate.

    Changes against a turn of the same session tell nothing about those against another session.
    """
    is_change = np.array(["change" in one.name for one in references.features])
    return ~is_change if is_one_session else np.ones_like(is_change)
