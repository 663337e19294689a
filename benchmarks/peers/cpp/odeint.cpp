// Boost.Odeint: an error-controlled explicit stepper, switches located by repeating the step with Newton's length.
#include <algorithm>
#include <boost/numeric/odeint.hpp>

#include "hammer.hpp"

namespace {

namespace odeint = boost::numeric::odeint;
using State = std::array<double, 2>;

template <class Stepper>
long march(const double* c, long pieces, const double* rows, double rest, double tolerance, long points,
           const double* grid, double* out) {
    hammer::Motion motion(c, rest);
    long evaluations = 0;
    auto system = [&](const State& y, State& rates, double t) {
        ++evaluations;
        rates = {y[1], motion.acceleration(t, y[0], y[1])};
    };
    auto controlled = odeint::make_controlled(tolerance, tolerance, Stepper());
    std::array<double, 4> first{0.05, 0.05, 0.05, 0.05};
    long next = 0;
    for (long p = 0; p < pieces; ++p) {
        motion.now = motion.piece(rows + 5 * p);
        double t = motion.now.begin;
        double h = first[motion.mode];
        bool fresh = true;
        controlled = odeint::make_controlled(tolerance, tolerance, Stepper());
        while (t < motion.now.end) {
            const double left = motion.now.end - t;
            double length = std::min(h, left);
            const bool cut = length < h;
            const State from{motion.x, motion.v};
            State to = from;
            double reached = t;
            while (controlled.try_step(system, to, reached, length) == odeint::fail) {
                if (length < 1e-14) return -1;
            }
            double done = reached - t;
            if (!cut || length < h) h = length;
            if (fresh) first[motion.mode] = std::min(done * 2.0, h);
            fresh = false;
            // A stepper keeps the last derivative that it saw, which belongs to another place.
            auto at = [&](double part, State& y) { Stepper().do_step(system, from, t, y, part); };
            // A free step that goes in and out again: look at its turning point.
            if (motion.mode == hammer::FREE && from[1] * to[1] < 0.0) {
                double low = 0.0, high = done;
                State y = to;
                for (int i = 0; i < 60 && high - low > 1e-3 * done; ++i) {
                    const double middle = low + (high - low) * 0.5;
                    at(middle, y);
                    (y[1] * from[1] > 0.0 ? low : high) = middle;
                }
                const auto g = motion.guards(y[0], y[1]);
                if (g[0] < 0.0 || g[1] < 0.0) to = y, done = low + (high - low) * 0.5, at(done, to);
            }
            const auto ends = motion.guards(to[0], to[1]);
            int which = -1;
            double part = done;
            for (int k = 0; k < 2; ++k) {
                if (ends[k] >= 0.0) continue;
                double low = 0.0, high = part;
                double s = motion.guards(from[0], from[1])[k];
                s = s <= 0.0 ? high * 0.9 : high * s / (s - ends[k]);
                State y;
                for (int i = 0; i < 60; ++i) {
                    at(s, y);
                    const double g = motion.guards(y[0], y[1])[k];
                    (g > 0.0 ? low : high) = s;
                    const double slope = motion.rates(y[1], motion.acceleration(t + s, y[0], y[1]))[k];
                    double better = s - g / slope;
                    if (!(better > low && better < high)) better = 0.5 * (low + high);
                    const bool same = std::abs(better - s) < 1e-15 * done + 1e-16 * t;
                    s = better;
                    if (same) break;
                }
                if (s <= part) part = s, which = k;
            }
            if (which >= 0) at(part, to);
            const double now = which < 0 ? (cut && done >= left * (1.0 - 1e-15) ? motion.now.end : t + done) : t + part;
            for (; next < points && grid[next] / hammer::TIME <= now; ++next) {
                State y = from;
                const double wanted = grid[next] / hammer::TIME - t;
                if (wanted > 0.0) at(wanted, y);
                out[next] = y[0] * hammer::LENGTH;
            }
            t = now;
            motion.x = to[0];
            motion.v = to[1];
            if (which >= 0) {
                motion.switch_over(which);
                h = first[motion.mode];
                fresh = true;
                controlled = odeint::make_controlled(tolerance, tolerance, Stepper());
            }
        }
    }
    for (; next < points; ++next) out[next] = motion.x * hammer::LENGTH;
    return evaluations;
}

}  // namespace

// Stepper 0: Dormand-Prince 5(4); 1: Runge-Kutta-Fehlberg 7(8). Returns force evaluations, or -1.
extern "C" long solve(long stepper, const double* c, long pieces, const double* rows, double rest, double tolerance,
                      long points, const double* grid, double* out) {
    if (stepper == 0)
        return march<odeint::runge_kutta_dopri5<State>>(c, pieces, rows, rest, tolerance, points, grid, out);
    return march<odeint::runge_kutta_fehlberg78<State>>(c, pieces, rows, rest, tolerance, points, grid, out);
}
