"""A particle filter with shadow matching: the set of hidden satellites determines a car's side of the street.

The car's receiver reports C/N0; for every particle the city's satellites in line of sight are computed
(`trace()` of all particles at once); its likelihood is their agreement with the C/N0.
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
particles = truth[0, :2] + rng.normal(0, 15, (count, 2))  # the start is known approximately
velocity = rng.normal(0, 5, (count, 2))
weights = np.full(count, 1 / count)
errors = []
for number, time in enumerate(epochs["time"]):
    now = seen["time"] == time
    velocity = velocity + rng.normal(0, 1.5, (count, 2))
    particles = particles + velocity
    # Satellites well above the horizon, with directions from the centre of the particles.
    az, el, cn0 = (seen[name][now] for name in ("azimuth_deg", "elevation_deg", "cn0_dbhz"))
    use = el > 15
    az, el, cn0 = np.radians(az[use]), np.radians(el[use]), np.where(np.isnan(cn0[use]), 10, cn0[use])
    directions = np.stack([np.sin(az) * np.cos(el), np.cos(az) * np.cos(el), np.sin(el)], 1)
    places = np.column_stack([particles, np.full(count, truth[number, 2])])
    rows = tracer.at(places, directions=directions)
    clear = rows["visibility"] <= canyon.VISIBILITIES.index("LOS+multipath")
    # In line of sight signals are strong, behind walls weak or missing: a wide logistic function around 33 dB-Hz.
    p_clear = 0.1 + 0.8 / (1 + np.exp(-(cn0 - 33) / 3))
    matching = np.where(clear, np.log(p_clear), np.log(1 - p_clear)).sum(1)
    # The fix determines the position along the street, within its usual ten metres. Shadows last for seconds,
    # and reported C/N0 are means: an epoch mostly repeats the previous one, so it gets a fifth of the weight.
    apart = np.linalg.norm(particles - fix[number, :2], axis=1)
    likelihood = 0.2 * matching - 0.5 * (apart / 10) ** 2
    likelihood[rows["placement"][:, 0] != canyon.PLACEMENTS.index("free")] = -np.inf  # no car drives through houses
    likelihood -= likelihood.max()
    weights = weights * np.exp(likelihood)
    weights = weights / weights.sum() if weights.sum() > 0 else np.full(count, 1 / count)
    estimate = weights @ particles
    errors.append([np.linalg.norm(estimate - truth[number, :2]), np.linalg.norm(fix[number, :2] - truth[number, :2])])
    if 1 / (weights**2).sum() < count / 2:  # too few particles have most of the weight
        chosen = rng.choice(count, count, p=weights)
        particles, velocity = particles[chosen] + rng.normal(0, 0.5, (count, 2)), velocity[chosen]
        weights = np.full(count, 1 / count)

matched, own = np.nanmedian(np.array(errors)[10:], axis=0)
print(f"median horizontal error: the receiver's own fix {own:.1f} m, with shadow matching {matched:.1f} m")
