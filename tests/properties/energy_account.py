"""The account of what a renderer's parameters fed, kept beside the law."""

T = 1e-3


class Account:
    """Energy that the joint took from a hand and its own damping less what the motor gave, since the last
    start.
    """

    def __init__(self, params, limit):
        self.k_c, self.b_c = params["coupling_stiffness_nm_rad"][0], params["coupling_damping_nms_rad"][0]
        self.store_j, self.power_w, self.limit = params["renderer_store_j"], params["renderer_power_w"], limit
        self.begin(0.0, 0.0)

    def begin(self, at_start, damper):
        """What is stored, and b_c d_0^2/(2 T) of the damper whose torque `damper`, N m, is held first."""
        # below 1e-15 N m s/rad it is less than 1e-12 J, and the slip is lost in rounding
        lag = 0.5 * T / self.b_c * damper**2 if self.b_c > 1e-15 else 0.0
        self.at_start = at_start + lag
        self.absorbed, self.granted, self.scale, self.ticks = 0.0, 0.0, 1e-12, 0

    def holding(self, step):
        return (0.5 * self.k_c + self.b_c / T) * step**2

    def held(self, torque, step):
        """The joint went `step` while the gate let this much of `torque` through."""
        sent = min(max(torque, -self.limit), self.limit)
        self.absorbed += self.holding(step) - sent * step
        self.scale += abs(torque * step)

    def check(self, granted):
        self.ticks += 1
        self.granted += granted
        assert self.granted <= self.store_j + self.power_w * T * self.ticks + 1e-12
        assert self.absorbed >= -self.at_start - self.granted - 1e-9 * (1.0 + self.scale)
