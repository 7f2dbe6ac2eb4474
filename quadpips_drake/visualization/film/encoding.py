"""Files of video: MP4 (H.264) and GIF, by the ffmpeg that the package imageio-ffmpeg brings."""

from collections.abc import Iterable
from itertools import islice
from pathlib import Path

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import replacing

SUFFIXES = (".mp4", ".gif")
MAX_GIF = 3_000_000
"""A README shows pictures up to this size well [bytes]."""
_SMALLER_GIFS = ((1, 1.0, 96), (1, 1.0, 48), (2, 1.0, 48), (2, 0.75, 48), (3, 0.75, 32), (4, 0.5, 24), (8, 0.5, 16))
"""Every how many pictures, scale and number of colours, tried in this order until a GIF is small enough."""


def check_film_name(path: Path, results: Path | None = None) -> None:
    """Raises UserInputError unless a film can be written to ``path``; the directory ``results`` will be there by then."""
    if path.suffix.lower() not in SUFFIXES:
        raise UserInputError(f"film {path}: its name must end in {' or '.join(SUFFIXES)}")
    if path.is_dir():
        raise UserInputError(f"film {path}: this is a directory; give the name of a file")
    if not path.parent.is_dir() and (results is None or path.parent.resolve() != results.resolve()):
        raise UserInputError(f"film {path}: there is no directory {path.parent}; make it first")


def save_film(path: Path, pictures: Iterable[np.ndarray], frames_per_second: float) -> int:
    """Writes ``pictures``, uint8 (height, width, 3), all of one size; returns the size of the file [bytes].

    Width and height of an MP4 must be even. A GIF becomes coarser until it has at most MAX_GIF bytes.

    Raises:
        UserInputError: the file cannot be written.
    """
    check_film_name(path)
    try:
        if path.suffix.lower() == ".mp4":
            with replacing(path) as unfinished:
                # Browsers play this kind of H.264, and begin before all of it is there.
                options = ["-preset", "medium", "-crf", "23", "-movflags", "+faststart", "-f", "mp4"]
                _encode(unfinished, pictures, frames_per_second, "libx264", "yuv420p", options)
        else:
            _save_gif(path, list(pictures), frames_per_second)
    except OSError as error:
        raise UserInputError(f"cannot write '{path}': {str(error).splitlines()[-1] if str(error) else error}") from None
    return path.stat().st_size


def _save_gif(path: Path, pictures: list[np.ndarray], frames_per_second: float) -> None:
    for every, scale, colors in _SMALLER_GIFS:
        with replacing(path) as unfinished:
            palette = f"[a]palettegen=max_colors={colors}:stats_mode=diff[p]"
            scaled = f"scale=iw*{scale}:-1:flags=area,split[a][b]"
            # Without dithering what does not move stays the same, and takes no room.
            options = [
                "-vf",
                f"{scaled};{palette};[b][p]paletteuse=dither=none:diff_mode=rectangle",
                "-loop",
                "0",
                "-f",
                "gif",
            ]
            _encode(unfinished, islice(pictures, 0, None, every), frames_per_second / every, "gif", "pal8", options)
            small_enough = unfinished.stat().st_size <= MAX_GIF
        if small_enough:
            return


def _encode(path: Path, pictures: Iterable[np.ndarray], rate: float, codec: str, pixels: str, options: list[str]) -> None:
    from imageio_ffmpeg import write_frames

    writer = None
    try:
        for picture in pictures:
            if writer is None:
                size = picture.shape[1], picture.shape[0]
                writer = write_frames(
                    path,
                    size,
                    fps=rate,
                    codec=codec,
                    pix_fmt_out=pixels,
                    quality=None,
                    macro_block_size=1,
                    output_params=options,
                    ffmpeg_log_level="error",
                )
                writer.send(None)
            writer.send(np.ascontiguousarray(picture))
    finally:
        if writer is not None:
            writer.close()
