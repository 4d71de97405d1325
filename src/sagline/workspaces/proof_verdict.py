"""What is proved of a box of poses."""

from __future__ import annotations

from sagline.kernels.workspaces.pose_box_proof import INSIDE, OPEN, OUTSIDE
from sagline.status import Status


class ProofVerdict(Status):
    """What is proved of a box of poses, or of a part of one."""

    OPEN = OPEN, "not decided, or only in part: see the shares; a longer budget proves more"
    PROVED_INSIDE = INSIDE, "at every pose every load is balanced by tensions within the limits"
    PROVED_OUTSIDE = OUTSIDE, "at no pose is every load balanced by tensions within the limits"
    PROVED_DIVIDED = 3, "decided everywhere: at some poses every load is balanced, at others not"
