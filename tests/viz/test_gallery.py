"""The pictures of the manual are those that its pages make, all there and small."""

from .gallery import IMAGES, saved, shown


def test_the_pages_make_what_they_show():
    assert shown() == saved() and len(shown()) > 8


def test_pictures_are_there_and_small():
    sizes = {name: (IMAGES / name).stat().st_size for name in shown()}
    assert max(sizes.values()) < 150e3
    assert not {path.name for path in IMAGES.iterdir() if path.is_file()} - shown()
