"""``gensig inspect`` of tables: those that gensig writes, and what is none."""

import pytest

from gensig.cli import main
from gensig.commands.sets.table_text import table_text
from gensig.errors import ConfigError

PLAN = "record_id,label_name,subset\nr000000,healthy,train\nr000001,crack,train\n"
TIMES = "".join(f"{number / 5000:.7f},{number % 7}\n" for number in range(300))


def written(folder, text):
    path = folder / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return str(path)


def test_labels_of_a_table_are_counted(tmp_path):
    file = written(tmp_path, PLAN)
    assert table_text(file) == (
        f"{file}: table as CSV\n"
        "  rows         2\n"
        "  columns      record_id, label_name, subset\n"
        "  label_name   2: crack 1, healthy 1\n"
        "  subset       1: train 2\n"
    )


def test_a_recording_tells_rate_length_and_channels(tmp_path):
    said = table_text(written(tmp_path, f"time_s,housing_g\n{TIMES}"))
    assert "rate         5000 Hz" in said
    assert "length       300 samples, 0.06 s" in said
    assert "channels     housing_g (RMS " in said


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a,b\n",
        "a,b\n1\n",
        "time_s,a\n0,1\n",
        f"time_s\n{TIMES}",
        b"a,\xff\n1,2\n",
        'a,"b\n1,2\n',
    ],
)
def test_what_is_no_table_is_one_line(tmp_path, text, capsys):
    file = written(tmp_path, text)
    with pytest.raises(ConfigError, match=r"table\.csv"):
        table_text(file)
    assert main(["inspect", file]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
