"""``diagnose predict``."""

from __future__ import annotations

from collections.abc import Sequence

from diagnose.commands.parser import verb_parser

HELP = """\
Class probabilities of one recording, with a flag for what is unlike the training data.

The recording is resampled to the model's rate; one with less bandwidth is refused. It is judged in windows of the
model's length; order tracking is not there yet: take a constant speed."""
EXAMPLE = """\
exit status:
  0    predicted, and like the training data (or the model is too old to tell)
  2    a mistake: one line says which
  3    predicted, but out of distribution: do not rely on the class

example:
  diagnose predict --model runs/report/models/by_unit-seed0 housing.wav --channels channel_1 --speed-rpm 1500"""
OUT_OF_DISTRIBUTION = 3


def run(words: Sequence[str]) -> int:
    """Print class probabilities; the exit status tells of a recording unlike the training data."""
    parser = verb_parser("predict", HELP, EXAMPLE)
    parser.add_argument("recording", metavar="RECORDING", help=".csv, .wav, .npy, .npz, .h5, .hdf5 or .mat")
    parser.add_argument("--model", required=True, metavar="DIR", help="folder that diagnose train wrote below models/")
    parser.add_argument("--sampling-rate", type=float, metavar="HZ", help="samples a second, where the file is silent")
    parser.add_argument("--speed-rpm", type=float, metavar="RPM", help="of the driving shaft: was it trained at such?")
    parser.add_argument("--channels", nargs="+", metavar="NAME", help="for the model's channels, in their order")
    parser.add_argument("--unit", default="m/s2", help="m/s2 or g, where the column does not say (default: m/s2)")
    parser.add_argument("--array", metavar="NAME", help="array of a .npz, .h5 or .mat file (default: acceleration)")
    parser.add_argument("--json", action="store_true", help="print everything, window by window, as JSON")
    arguments = parser.parse_args(words)
    from diagnose.model_io import load_domain, load_model
    from diagnose.predict import Source, predict_recording, summary

    source = Source(
        file=arguments.recording,
        sampling_rate=arguments.sampling_rate,
        speed_rpm=arguments.speed_rpm,
        channels=None if arguments.channels is None else tuple(arguments.channels),
        unit=arguments.unit,
        array=arguments.array,
    )
    model, description = load_model(arguments.model)
    result = predict_recording(model, description, load_domain(arguments.model, description), source)
    if arguments.json:
        import json

        print(json.dumps({"model": arguments.model, **result}, indent=2, allow_nan=False))
    else:
        print(summary(result))
    return OUT_OF_DISTRIBUTION if result["out_of_distribution"] else 0
