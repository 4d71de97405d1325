"""Speed limit: the same path in shorter times, with inertia."""

import sagline as sl

robot = sl.load_robot("article-suspended")
way = [(-3.0, 0.0, 2.0), (3.0, 0.0, 2.0)]
fastest = None
for seconds in (6.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.0):
    path = sl.quintic_path(way, durations=seconds)
    plan = sl.inverse(robot, path)
    if not plan.feasible.all():
        gap = plan.gaps[0]
        when = path.time[gap.first]
        print(
            f"{seconds} s: fails after {when:.2f} s",
            f"by {gap.shortfall:.0f} N, cables {gap.cables}",
        )
        break
    fastest = seconds
    sl.plot.save(sl.plot.tensions(plan), "how_fast.png")
    low, high = plan.chord_tension.min(), plan.chord_tension.max()
    print(f"{seconds} s: {low:.0f} to {high:.0f} N")
