"""A particle filter with shadow matching: which satellites are hidden says on which side of the street a car is.

The car's receiver states C/N0; every particle asks the city which satellites stand in sight at its place
(`trace()` of all particles at once), and is as likely as these agree with the C/N0.
"""

import numpy as np

import canyon

rng = np.random.default_rng(1)
scenario = canyon.Scenario.load(
    "examples/synthetic_drive.yaml", duration_s=60, rate_hz=1, sky={"systems": ["GPS", "GLONASS", "Galileo", "BeiDou"]}
)
city = canyon.City.of_scenario(scenario)
run = canyon.simulate(scenario, city)
epochs, seen = run.epochs, run.satellites
truth = city.enu_of(np.stack([epochs[f"true_{axis}"] for axis in ("latitude_deg", "longitude_deg", "height_m")], 1))
fix = city.enu_of(np.stack([epochs[f"fix_{axis}"] for axis in ("latitude_deg", "longitude_deg", "height_m")], 1))

tracer = canyon.Tracer(city, reflection_order=1)
count = 400
particles = truth[0, :2] + rng.normal(0, 15, (count, 2))  # somebody said where it starts, roughly
velocity = rng.normal(0, 5, (count, 2))
weights = np.full(count, 1 / count)
errors = []
for number, time in enumerate(epochs["time"]):
    now = seen["time"] == time
    velocity = velocity + rng.normal(0, 1.5, (count, 2))
    particles = particles + velocity
    # Satellites well above the horizon, their directions from the middle of the cloud.
    az, el, cn0 = (seen[name][now] for name in ("azimuth_deg", "elevation_deg", "cn0_dbhz"))
    use = el > 15
    az, el, cn0 = np.radians(az[use]), np.radians(el[use]), np.where(np.isnan(cn0[use]), 10, cn0[use])
    directions = np.stack([np.sin(az) * np.cos(el), np.cos(az) * np.cos(el), np.sin(el)], 1)
    places = np.column_stack([particles, np.full(count, truth[number, 2])])
    rows = tracer.at(places, directions=directions)
    clear = rows["visibility"] <= canyon.VISIBILITIES.index("LOS+multipath")
    # In sight signals are strong, behind walls weak or none: a logistic about 33 dB-Hz, not too sure of itself.
    p_clear = 0.1 + 0.8 / (1 + np.exp(-(cn0 - 33) / 3))
    matching = np.where(clear, np.log(p_clear), np.log(1 - p_clear)).sum(1)
    # The fix still says along which stretch of the street it is, within its usual ten metres. Shadows last for seconds,
    # and stated C/N0 are means: what an epoch says is mostly what the one before said, and counts a fifth.
    apart = np.linalg.norm(particles - fix[number, :2], axis=1)
    likelihood = 0.2 * matching - 0.5 * (apart / 10) ** 2
    likelihood[rows["placement"][:, 0] != canyon.PLACEMENTS.index("free")] = -np.inf  # no car drives through houses
    likelihood -= likelihood.max()
    weights = weights * np.exp(likelihood)
    weights = weights / weights.sum() if weights.sum() > 0 else np.full(count, 1 / count)
    estimate = weights @ particles
    errors.append([np.linalg.norm(estimate - truth[number, :2]), np.linalg.norm(fix[number, :2] - truth[number, :2])])
    if 1 / (weights**2).sum() < count / 2:  # too few particles carry the weight
        chosen = rng.choice(count, count, p=weights)
        particles, velocity = particles[chosen] + rng.normal(0, 0.5, (count, 2)), velocity[chosen]
        weights = np.full(count, 1 / count)

matched, own = np.nanmedian(np.array(errors)[10:], axis=0)
print(f"median horizontal error: the receiver's own fix {own:.1f} m, with shadow matching {matched:.1f} m")
