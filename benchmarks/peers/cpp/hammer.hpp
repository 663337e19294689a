// The equation of motion of the benchmark, mode by mode, in units in which displacement and velocity are of order one.
#pragma once
#include <array>
#include <cmath>

namespace hammer {

enum Mode { FREE, LOADING, UNLOADING, BACKSTOP };
constexpr double LENGTH = 1e-4, TIME = 1e-4;

// One smooth piece of the current: a + b exp(-rate (t - begin)); times in units of TIME.
struct Piece {
    double begin, end, a, b, rate;
};

class Motion {
   public:
    Motion(const double* c, double rest) : c_(c), x(rest / LENGTH), front(c[7] / LENGTH), position(c[9] / LENGTH) {}

    Piece piece(const double* row) const {
        return {row[0] / TIME, row[1] / TIME, row[2], row[3], row[4] * TIME};
    }

    double acceleration(double t, double y, double u) const {
        const double* c = c_;
        const double metres = y * LENGTH;
        double current = now.a;
        if (now.b != 0.0) current += now.b * std::exp(-now.rate * (t - now.begin));
        const double reduced = c[2] - c[3] * current;
        double f = c[1] - reduced * reduced / std::sqrt(metres) + c[4] - c[4] / c[5] * (metres - c[9]);
        if (mode == BACKSTOP) {
            const double depth = c[9] - metres;
            if (depth > 0.0) f += depth * std::sqrt(depth) * (c[10] - c[11] * u * (LENGTH / TIME));
        } else if (mode != FREE) {
            const double r = (metres - c[7]) / c[8];
            if (r > 0.0) {
                if (mode == LOADING) {
                    f -= c[6] * std::pow(r, 2.7);
                } else {
                    const double r2 = r * r, r4 = r2 * r2;
                    f -= memory * r4 * r4 * r2 * r;
                }
            }
        }
        return f / c[0] * (TIME * TIME / LENGTH);
    }

    // Switching functions, positive while the mode lasts.
    std::array<double, 2> guards(double y, double u) const {
        switch (mode) {
            case FREE: return {y - position, front - y};
            case LOADING: return {u, 1.0};
            case UNLOADING: return {y - front, -u};
            default: return {position - y, 1.0};
        }
    }

    // Their time derivatives.
    std::array<double, 2> rates(double u, double a) const {
        switch (mode) {
            case FREE: return {u, -u};
            case LOADING: return {a, 0.0};
            case UNLOADING: return {u, -a};
            default: return {-u, 0.0};
        }
    }

    // Leave the mode through one of its switches, at exactly that place.
    void switch_over(int which) {
        switch (mode) {
            case FREE:
                x = which == 0 ? position : front;
                mode = which == 0 ? BACKSTOP : LOADING;
                break;
            case LOADING:
                v = 0.0;
                memory = c_[6] * std::pow((x * LENGTH - c_[7]) / c_[8], -8.3);
                mode = UNLOADING;
                break;
            case UNLOADING:
                if (which == 0) {
                    x = front;
                    mode = FREE;
                } else {
                    v = 0.0;
                    mode = LOADING;
                }
                break;
            default:
                x = position;
                mode = FREE;
        }
    }

   private:
    const double* c_;

   public:
    double x, v = 0.0, front, position, memory = 0.0;
    Mode mode = BACKSTOP;
    Piece now{};
};

}  // namespace hammer
