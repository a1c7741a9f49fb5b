"""A reinforcement-learning environment with Gymnasium's interface: a robot avoids areas of bad GNSS.

Gymnasium is not needed: `reset()` and `step()` have its signatures. The robot has only its receiver's output;
each step costs its length, and more where the expected error is large. A planner with the map
(value iteration) shows the optimum.
"""

import numpy as np

import canyon


class Streets:
    """A walk from one corner of a downtown to another on a grid.

    Observation: (east, north) of the fix [m], satellites used, HDOP. Actions: 0 east, 1 north,
    2 west, 3 south. Reward: -1 per step, -error / 10 m, +100 at the goal.
    """

    moves = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])

    def __init__(self, size_m=200.0, step_m=8.0, seed=7):
        self.city = canyon.City(
            synthetic={"blocks_east": 4, "blocks_north": 4, "max_height_m": 150, "seed": seed},
            origin={"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0},
        )
        self.step_m = step_m
        half = size_m / 2
        self.start_time = "2026-06-01T08:00:00Z"
        scenario = canyon.Scenario(
            city={
                "synthetic": {"blocks_east": 4, "blocks_north": 4, "max_height_m": 150, "seed": seed},
                "origin": {"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0},
            },
            sky={"systems": ["GPS", "Galileo"]},
            start=self.start_time,
            receivers=[{"name": "walker", "profile": "ideal"}],
        )
        self.map = canyon.heatmap(scenario, self.city, box=(-half, -half, half, half), spacing_m=step_m, altitudes_m=1.5,
                                  layers=["horizontal_error"])
        self.free = self.map.state[0] == 0
        error = self.map["horizontal_error"][0, 0]
        self.error = np.where(np.isnan(error), 100.0, np.minimum(error, 100.0))
        corners = np.argwhere(self.free)
        self.begin, self.goal = tuple(corners[0]), tuple(corners[-1])
        self.receiver = canyon.ReceiverRunner(self.city, self.start_time, profile="ideal",
                                            sky={"systems": ["GPS", "Galileo"]})

    def _observe(self):
        row, column = self.cell
        place = (float(self.map.east_m[column]), float(self.map.north_m[row]), 1.5)
        epoch = self.receiver.observe(float(self.seconds), place)
        if not epoch.solved:
            return np.array([np.nan, np.nan, 0, np.nan])
        believed = place + epoch.error_enu_m
        return np.array([believed[0], believed[1], epoch.used, np.sqrt(np.trace(epoch.covariance_enu_m2[:2, :2]))])

    def reset(self, *, seed=None, options=None):
        self.cell, self.seconds = self.begin, 0
        self.receiver.restart()
        return self._observe(), {"cell": self.cell}

    def step(self, action):
        column, row = self.moves[action] + self.cell[::-1]
        inside = 0 <= row < self.free.shape[0] and 0 <= column < self.free.shape[1]
        if inside and self.free[row, column]:
            self.cell = (int(row), int(column))
        self.seconds += 4
        done = self.cell == self.goal
        reward = -1 - self.error[self.cell] / 10 + 100 * done
        return self._observe(), float(reward), done, self.seconds > 4000, {"cell": self.cell}


def plan(env, weight):
    """Cheapest path to the goal, with a step cost of 1 + weight * error / 10 m: policy by value iteration."""
    value = np.full(env.free.shape, np.inf)
    value[env.goal] = 0
    cost = np.where(env.free, 1 + weight * env.error / 10, np.inf)
    for _ in range(env.free.size):
        after = np.pad(value + cost, 1, constant_values=np.inf)
        ways = np.stack([after[1:-1, 2:], after[2:, 1:-1], after[1:-1, :-2], after[:-2, 1:-1]])
        better = np.minimum(value, ways.min(0))
        if np.array_equal(better, value):
            break
        value = better
    return ways.argmin(0)


def walk(env, policy):
    observation, info = env.reset()
    total, steps, errors = 0.0, 0, []
    terminated = truncated = False
    while not (terminated or truncated):
        observation, reward, terminated, truncated, info = env.step(int(policy[info["cell"]]))
        total, steps = total + reward, steps + 1
        errors.append(env.error[info["cell"]])
    return total, steps, float(np.mean(errors)), float(np.max(errors)), observation


if __name__ == "__main__":
    environment = Streets()
    print(f"grid {environment.free.shape}, {environment.free.mean():.0%} free; from {environment.begin} to {environment.goal}")
    for name, weight in [("shortest way", 0.0), ("around bad GNSS", 1.0)]:
        total, steps, mean, largest, last = walk(environment, plan(environment, weight))
        print(f"{name:16} {steps:3} steps, reward {total:7.1f}, error on the way: mean {mean:5.1f} m, largest {largest:5.1f} m")
