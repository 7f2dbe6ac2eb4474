"""What a trial tells those who watch it: the story over a recording, films, replays."""
