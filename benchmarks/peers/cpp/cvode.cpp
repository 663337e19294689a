// SUNDIALS CVODE: Adams methods with functional iteration, its own root finding, started anew at every switch.
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_version.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>

#include "hammer.hpp"

namespace {

struct Run {
    hammer::Motion motion;
    long evaluations;
};

int rates(double t, N_Vector y, N_Vector out, void* data) {
    Run& run = *static_cast<Run*>(data);
    ++run.evaluations;
    const double* from = N_VGetArrayPointer(y);
    double* to = N_VGetArrayPointer(out);
    to[0] = from[1];
    to[1] = run.motion.acceleration(t, from[0], from[1]);
    return 0;
}

int guards(double, N_Vector y, double* g, void* data) {
    const double* from = N_VGetArrayPointer(y);
    const auto found = static_cast<Run*>(data)->motion.guards(from[0], from[1]);
    g[0] = found[0];
    g[1] = found[1];
    return 0;
}

}  // namespace

// Returns force evaluations, or -1.
extern "C" long solve(long, const double* c, long pieces, const double* rows, double rest, double tolerance, long points,
                      const double* grid, double* out) {
    SUNContext context;
#if SUNDIALS_VERSION_MAJOR >= 7
    SUNContext_Create(SUN_COMM_NULL, &context);
#else
    SUNContext_Create(nullptr, &context);
#endif
    Run run{hammer::Motion(c, rest), 0};
    hammer::Motion& motion = run.motion;
    N_Vector y = N_VNew_Serial(2, context);
    N_Vector dense = N_VNew_Serial(2, context);
    double* state = N_VGetArrayPointer(y);
    void* solver = CVodeCreate(CV_ADAMS, context);
    state[0] = motion.x;
    state[1] = 0.0;
    CVodeInit(solver, rates, 0.0, y);
    CVodeSStolerances(solver, tolerance, tolerance);
    CVodeSetUserData(solver, &run);
    CVodeSetMaxNumSteps(solver, 1000000);
    SUNNonlinearSolver iteration = SUNNonlinSol_FixedPoint(y, 0, context);
    CVodeSetNonlinearSolver(solver, iteration);
    CVodeRootInit(solver, 2, guards);
    int falling[2] = {-1, -1};
    CVodeSetRootDirection(solver, falling);
    CVodeSetNoInactiveRootWarn(solver);
    std::array<double, 4> first{1e-4, 1e-4, 1e-4, 1e-4};
    long next = 0;
    bool failed = false;
    for (long p = 0; p < pieces && !failed; ++p) {
        motion.now = motion.piece(rows + 5 * p);
        double t = motion.now.begin;
        bool fresh = true;
        while (t < motion.now.end) {
            if (fresh) {
                CVodeReInit(solver, t, y);
                CVodeSetInitStep(solver, std::min(first[motion.mode], 0.5 * (motion.now.end - t)));
                CVodeSetStopTime(solver, motion.now.end);
            }
            const int outcome = CVode(solver, motion.now.end, y, &t, CV_ONE_STEP);
            if (outcome < 0) {
                failed = true;
                break;
            }
            if (fresh) CVodeGetActualInitStep(solver, &first[motion.mode]);
            fresh = false;
            for (; next < points && grid[next] / hammer::TIME <= t; ++next) {
                CVodeGetDky(solver, grid[next] / hammer::TIME, 0, dense);
                out[next] = N_VGetArrayPointer(dense)[0] * hammer::LENGTH;
            }
            if (outcome == CV_ROOT_RETURN) {
                int found[2];
                CVodeGetRootInfo(solver, found);
                motion.x = state[0];
                motion.v = state[1];
                motion.switch_over(found[0] != 0 ? 0 : 1);
                state[0] = motion.x;
                state[1] = motion.v;
                fresh = true;
            }
        }
    }
    for (; next < points; ++next) out[next] = state[0] * hammer::LENGTH;
    CVodeFree(&solver);
    SUNNonlinSolFree(iteration);
    N_VDestroy(y);
    N_VDestroy(dense);
    SUNContext_Free(&context);
    return failed ? -1 : run.evaluations;
}
