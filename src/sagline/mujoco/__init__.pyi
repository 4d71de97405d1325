"""Public names of `sagline.mujoco`."""

from .model import attach as attach
from .model import model_of as model_of
from .plugin import build_plugin as build_plugin
from .plugin import load_plugin as load_plugin
