"""Mistakes in the group ``sensing``: each is one line that names the key."""

import re

import pytest
import yaml
from refusals import refused
from sensing_groups import BEARING, HOUSING, MACHINE, changed

from gensig.sensing.options import NESTED, read_sensing

OPTIONS = {"bearing": BEARING, "housing": HOUSING, "machine": MACHINE}
RESONANCE = "{kind: impulsive, share: 1, knocks_hz: 5, ring_hz: 3000, damping_ratio: 2}"
HUM = "{kind: hum, share: 1, mains_hz: 50, n_harmonics: 3}"
REFUSED = {
    # an option and a key of it
    "bearing sampling_rate_hz=10": "sampling_rate_hz = 10 must lie in 1000..1e+06",
    "bearing channels=[]": "channels = [] must name at least one channel",
    "bearing channels=[pinion_y, pinion_y]": "name at least one channel, each once",
    "bearing snr_reference=me": "= 'me'; allowed: healthy_twin, record",
    "bearing gain_scatter=0.6": "sensing.gain_scatter = 0.6 must lie in 0..0.5",
    # sensors and paths
    "housing sensors=null": "that a transfer path leads to: give at least one",
    "bearing sensors=[a]": "leave it null with sensing.path.kind = identity",
    "housing sensors=[a, a]": "must name at least one sensor, each once",
    "housing sensors=[a b]": "sensing.sensors: 'a b'",
    "housing sensors=[my_rotation]": "not ending in 'rotation'",
    "housing channels=[pinion_rotation]": "pinion_rotation is no bearing",
    "housing sampling_rate_hz=20000": "above the usable band of 7812.5 Hz",
    "housing sampling_rate_hz=25600": "or a rate of at least 30720 Hz",
    "housing noise.band_hz=[10, 30000]": "above half of sensing.sampling_rate_hz",
    "housing path={kind: measured, file: x}": "tells no transverse motion",
    "housing path.n_modes=[9, 3]": "path.n_modes = [9, 3] must be two ordered numbers",
    "housing path.natural_frequency_hz=[0, 3000]": "natural_frequency_hz = [0, 3000]",
    "housing path.damping_ratio=[0.01, 1.9]": "path.damping_ratio = [0.01, 1.9]",
    "housing path.transmissibility=0": "transmissibility = 0 must be positive",
    "bearing path={kind: modal}": "sensing.path: missing n_modes",
    "bearing path={kind: short}": "= 'short'; allowed: identity, modal, measured",
    "bearing path=null": "sensing.path.kind = None",
    "bearing path={kind: identity, file: x}": "unknown key 'file'",
    # accelerometers
    "bearing channels=[pinion_y] sensor.transverse_sensitivity=0.1": "the other axis",
    "bearing sensor.adc_bits=12": "give both adc_range_m_per_s2 and adc_bits",
    "bearing sensor.adc_range_m_per_s2=0": "adc_range_m_per_s2 = 0 must be positive",
    "bearing sensor.dropped_fill=nan": "dropped_fill = 'nan'; allowed: hold, zero",
    # tachometer and encoder
    "bearing tacho=null": "sensing.tacho = None must be a group of keys",
    "bearing tacho={shaft: pinion}": "sensing.tacho: missing pulses_per_turn",
    "bearing tacho.pulses_per_turn=0": "must lie in 1..1000; sensing.encoder has more",
    "bearing tacho.pulse_width_share=1": "= 1 must lie in 0.001..0.999",
    "bearing tacho.jitter_deg=-5": "sensing.tacho.jitter_deg = -5",
    "bearing tacho.jitter_deg=5": "0..2.25, an eighth of the narrower of pulse and gap",
    "bearing encoder={lines: 3}": "sensing.encoder: unknown key 'lines'",
    "bearing encoder.lines_per_turn=3": "lines_per_turn = 3 must lie in 4..100000",
    "bearing encoder.eccentricity_error_deg=6": "eccentricity_error_deg = 6 must lie",
    "bearing encoder.line_error_deg=0.5": "line_error_deg = 0.5 must lie in 0..0.035",
    # noise
    "bearing noise={parts: []}": "must be a group of the keys parts and band_hz",
    "bearing noise.parts=[]": "sensing.noise.parts = [] has no part",
    "bearing noise.parts=white": ".parts = 'white' must be a list",
    "bearing noise.parts=[{kind: brown}]": "[0]: kind = 'brown'; allowed: white, pink",
    "bearing noise.parts=[{kind: white, share: 0}]": "[0].share = 0 must be positive",
    "bearing noise.parts=[{kind: path, share: 1}]": "kind path needs a transfer path",
    f"bearing noise.parts=[{RESONANCE}]": "damping_ratio = 2 must lie in 0.001..1",
    "bearing noise.band_hz=[100.0]": ".band_hz = [100.0] must be [low, high]",
    "bearing noise.band_hz=[200, 100]": "must be [low, high], ordered",
    "bearing noise.band_hz=all": ".band_hz = 'all' must be [low, high] in Hz, or null",
    f"bearing noise.parts=[{HUM}] noise.band_hz=[9, 20]": "tones alone may miss the band",
    "bearing noise.offsets_db=loud": "must be a list of numbers, one a sensor",
    "bearing noise.offsets_db=[x]": "must be a list of numbers, one a sensor",
    "bearing noise.offsets_db=[.nan]": "must be a list of numbers, one a sensor",
    "bearing snr_db=null noise.level_m_per_s2=0": "level_m_per_s2 = 0 must be positive, or null",
    "bearing snr_db=null noise.level_m_per_s2=loud": "level_m_per_s2 = 'loud' must be a number",
    "bearing snr_db=null noise.file_level=true": "needs one part of kind file or spectrum",
    "bearing snr_db=null noise.file_level=1": "file_level = 1 must be true or false",
    "bearing snr_db=null noise.level_m_per_s2=1 noise.density_ug_per_sqrt_hz=1": "give one",
    "bearing noise.level_m_per_s2=1": "both set the level of the noise: add sensing.snr_db=null",
    # nuisances
    "bearing nuisances=null": "sensing.nuisances = None must be a list of parts",
    "bearing nuisances={kind: bearing}": "must be a list of parts",
    "machine nuisances.0.rated_speed_rpm=-1": "rated_speed_rpm = -1 must lie in 1..1e+06",
    "machine nuisances.2.order_shares=[]": "[2].number of order_shares = 0 must lie",
    "machine nuisances.2.order_shares=[-1]": "[2].order_shares = -1 must lie in 0..100",
    "machine nuisances.4.ball_diameter_mm=50": "of ball_diameter_mm = 50 do not fit on",
    "machine nuisances.0.kind=neighbor": "[0]: kind = 'neighbor'; allowed: unbalance",
}


def test_a_low_cutoff_may_be_a_tenth_of_the_sampling_rate():
    changes = {"sampling_rate_hz": 1000, "sensor.low_cutoff_hz": 100}
    assert read_sensing(changed(OPTIONS["bearing"], changes)).sensor.low_cutoff == 100


@pytest.mark.parametrize("typed", REFUSED)
def test_a_mistake_is_one_line(typed):
    option, words = typed.split(" ", 1)
    changes = {}
    for word in re.split(r" (?=[\w.]+=)", words):
        key, value = word.split("=", 1)
        changes[key] = yaml.safe_load(value)

    with refused(REFUSED[typed]) as caught:
        read_sensing(changed(OPTIONS[option], changes))

    text = str(caught.value)
    assert text.startswith("sensing")
    assert "\n" not in text


def test_a_group_without_its_parts_is_named():
    plain = {key: value for key, value in BEARING.items() if key not in NESTED}
    with refused("sensing: missing path, sensor, noise, nuis"):
        read_sensing(plain)
