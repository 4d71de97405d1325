"""Public names of `sagline.motion`."""

from .anchors import AnchorMotion as AnchorMotion
from .anchors import anchors_on_bases as anchors_on_bases
from .path import Path as Path
from .path import path_from_samples as path_from_samples
from .rest_to_rest import article_path as article_path
from .rest_to_rest import quintic_path as quintic_path
from .rest_to_rest import septic_path as septic_path
