"""The machine behind the link: the robot as it is, its drives, PLCs and network."""

from sagline.twin.injected import KINDS, Injected, fault
from sagline.twin.machine import Machine
from sagline.twin.server import SCAN, Server
from sagline.twin.snapshot import Report

__all__ = ["KINDS", "SCAN", "Injected", "Machine", "Report", "Server", "fault"]
