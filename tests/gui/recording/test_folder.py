"""The folder of recordings is closed, and nothing else is."""

import stat

from gui.recording.folder import open_folder


def _mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_a_folder_of_recordings_is_closed(tmp_path):
    folder = tmp_path / "recordings"
    folder.mkdir(mode=0o755)
    (folder / "session.bag").touch(0o644)
    assert _mode(open_folder(folder)) == 0o700 and _mode(folder / "session.bag") == 0o600


def test_a_project_in_which_somebody_records_stays_open(tmp_path):
    (tmp_path / "README.md").touch(0o644)
    (tmp_path / "session.bag").touch(0o644)
    tmp_path.chmod(0o755)
    assert _mode(open_folder(tmp_path)) == 0o755
    assert _mode(tmp_path / "README.md") == 0o644 and _mode(tmp_path / "session.bag") == 0o600
