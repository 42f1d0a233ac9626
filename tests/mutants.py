"""Planted faults: one text change each, applied to derivation, scheme, printing or C runtime.

Each entry is (what is wrong, file, old text, new text). The old text must occur in the file; its
first occurrence is replaced.
"""

from typing import NamedTuple


class Mutant(NamedTuple):
    """One planted fault."""

    fault: str
    file: str
    old: str
    new: str


D, L, G, P = "codegen/derive/quantities.py", "codegen/schemes/lobatto.py", "codegen/graph.py", "codegen/c/printer.py"
T, C, S = "codegen/schemes/tableau.py", "codegen/frontend/sympy_to_casadi.py", "codegen/c/spec.py"
PATH = "runtime/c/sg_path.c"
CENTRAL = "runtime/c/sg_central.c"
SMOOTH = "runtime/c/sg_smooth.c"
NEWTON, SOLVE, CHECK = "runtime/c/sg_newton.c", "runtime/c/sg_solve.c", "runtime/c/sg_check.c"
FORWARD = "runtime/c/sg_forward.c"
IMPACT, LOCATED = "runtime/c/sg_impact.c", "runtime/c/sg_located.c"
ADVANCE = "runtime/c/sg_advance.c"
STEP, TICK = "runtime/c/sg_cover.c", "runtime/c/sg_step.c"
SCALE, LINALG = "runtime/c/sg_scale.c", "runtime/c/sg_linalg.c"
PROX, SIMULATE = "runtime/c/sg_prox.c", "runtime/c/sg_simulate.c"

FULL = "codegen/schemes/full_order.py"
LEAST = "runtime/c/sg_least.c"
COULOMB, SIGNORINI = "runtime/c/sg_law_coulomb.c", "runtime/c/sg_law_signorini.c"
CONTACT, SYSTEM, MASS = "runtime/c/sg_contact.c", "runtime/c/sg_system.c", "runtime/c/sg_mass.c"
LINEAR = "runtime/c/sg_linear.c"
SLIP_CHECK, NORMAL_CHECK = "runtime/c/sg_law_coulomb_check.c", "runtime/c/sg_law_signorini_check.c"

MUTANTS: tuple[Mutant, ...] = (
    # derivation
    Mutant("g_dot without dg/dt", D, 'return self["g_q"] @ self.data.v + self["chi_g"]', 'return self["g_q"] @ self.data.v'),
    Mutant("g_N_dot without dg_N/dt", D, 'return self["g_N_q"] @ self.data.v + self["chi_N"]', 'return self["g_N_q"] @ self.data.v'),
    Mutant("energy with the sign of L flipped", D, "ca.dot(self[\"p\"], self.data.v) - self.data.L", "ca.dot(self[\"p\"], self.data.v) + self.data.L"),
    Mutant("F without f", D, 'self.h * (self["L_q"] + self["f"]) + self["WR"]', 'self.h * self["L_q"] + self["WR"]'),
    Mutant("F with -f", D, 'self.h * (self["L_q"] + self["f"])', 'self.h * (self["L_q"] - self["f"])'),
    Mutant("F without h on f", D, 'self.h * (self["L_q"] + self["f"])', '(self.h * self["L_q"] + self["f"])'),
    Mutant("F with -W R", D, '+ self["WR"]', '- self["WR"]'),
    Mutant("W without W_gamma", D, 'self["W_g"], self["W_gamma"], self["W_N"]', 'self["W_g"], 0 * self["W_gamma"], self["W_N"]'),
    Mutant("W_N with its sign flipped", D, 'def _W_N(self) -> ca.SX:\n        return self["g_N_q"].T', 'def _W_N(self) -> ca.SX:\n        return -self["g_N_q"].T'),
    Mutant("radius of friction elements without h", D, "[self.h * ca.if_else(bound[k] > 0, bound[k], 0)", "[ca.if_else(bound[k] > 0, bound[k], 0)"),
    Mutant("a negative bound is not cut off", D, "ca.if_else(bound[k] > 0, bound[k], 0)", "ca.fabs(bound[k])"),
    Mutant("guard ignored", D, "ca.SX(0) if c.guard is None else c.guard", "ca.SX(0)"),
    Mutant("e_F in place of e_N", D, "return self._column([c.e_N for c in self.data.contacts])", "return self._column([c.e_F for c in self.data.contacts])"),
    # scheme
    Mutant("plus sum in the momentum rows, the paper's misprint", L, 'r_i = r_i - self.a_hat(i, j) * self.at(j, "F")', 'r_i = r_i + self.a_hat(i, j) * self.at(j, "F")'),
    Mutant("a for a_hat in the momentum rows", L, 'r_i = r_i - self.a_hat(i, j) * self.at(j, "F")', 'r_i = r_i - self.a(i, j) * self.at(j, "F")'),
    Mutant("a_hat transposed", L, 'r_i = r_i - self.a_hat(i, j) * self.at(j, "F")', 'r_i = r_i - self.a_hat(j, i) * self.at(j, "F")'),
    Mutant("a_hat for a in the positions", L, "rate += self.a(i, j) * self.x", "rate += self.a_hat(i, j) * self.x"),
    Mutant("t_n for t^i, the paper's misprint", L, "(self.time(i), q, v, Ref(\"u\")", "(Time(0.0), q, v, Ref(\"u\")"),
    Mutant("start time at the end of the step", L, "arguments = (Time(1.0), q, v, Parameters())", "arguments = (Time(0.0), q, v, Parameters())"),
    Mutant("stage kinematics one stage early", L, "y += [ca.densify(self.at(i, name)) for name in _STAGE_ROWS]", "y += [ca.densify(self.at(i - 1, name)) for name in _STAGE_ROWS]"),
    Mutant("radius of the stage of the slip", L, 'radius.append(ca.densify(self.at(i - 1, "rho")))', 'radius.append(ca.densify(self.at(i, "rho")))'),
    Mutant("last stage left out of the end row", L, 'r = r - self.b(s - 1) * self.at(s - 1, "F")', 'r = r - 0 * self.at(s - 1, "F")'),
    Mutant("percussions of inner stages counted twice", L, "last = last - self.b(j) * self.R(j)\n        # b_s", "last = last + self.b(j) * self.R(j)\n        # b_s"),
    Mutant("b_0 for b_j in the end row", L, 'r = r - self.b(j) * self.at(j, "F")', 'r = r - self.b(0) * self.at(j, "F")'),
    Mutant("restitution with the sign flipped", "codegen/program.py", "xi_N.append(e_N[k] * g_N_dot[normal])", "xi_N.append(-e_N[k] * g_N_dot[normal])"),
    Mutant("e_N squared", "codegen/program.py", "xi_N.append(e_N[k] * g_N_dot[normal])", "xi_N.append(e_N[k] * e_N[k] * g_N_dot[normal])"),
    Mutant("e_F left out", "codegen/program.py", "xi_F += [e_F[k] * gamma_F[first + j]", "xi_F += [0 * e_F[k] * gamma_F[first + j]"),
    Mutant("restitution of the wrong slip row", "codegen/program.py", "xi_F += [e_F[k] * gamma_F[first + j]", "xi_F += [e_F[k] * gamma_F[first]"),
    Mutant("dp/dq left out of A", L, 'block = self.h * self.a(i, k) * self.at(i, "p_q")', 'block = 0 * self.h * self.a(i, k) * self.at(i, "p_q")'),
    Mutant("dF/dv left out of A", L, 'return value + self.at(j, "F_v") if j == k else value', "return value"),
    Mutant("dF/dq with half weight", L, 'value = self.h * self.a(j, k) * self.at(j, "F_q")', 'value = self.h * self.a(j, k) * self.at(j, "F_q") / 2'),
    Mutant("sign of B", L, "B = [[-self.a_hat(i, j) * W[j]", "B = [[self.a_hat(i, j) * W[j]"),
    Mutant("dgamma/dq left out of C", L, 'gamma = ha * self.at(i, "gamma_q")', 'gamma = 0 * ha * self.at(i, "gamma_q")'),
    Mutant("dgamma_F/dq left out of C", L, 'gamma_F = ha * self.at(i, "gamma_F_q")', 'gamma_F = 0 * ha * self.at(i, "gamma_F_q")'),
    Mutant("radius of the whole step with equal weights", L, 'radius += self.b(j) * ca.densify(self.at(j, "rho"))', 'radius += ca.densify(self.at(j, "rho")) / s'),
    Mutant("R^s with b_0", L, "last / self.b(self.s - 1)", "last / self.b(0) * 0.5"),
    # tableau
    Mutant("a_hat without the factor b_j/b_i", T, "b[j] - b[j] * a[j][i] / b[i]", "b[j] - a[j][i]"),
    Mutant("nodes on [-1, 1]", T, "(mp.re(x) + 1) / 2", "mp.re(x)"),
    Mutant("integral off by one", T, "p * x ** (k + 1) / (k + 1)", "p * x ** (k + 1) / (k + 2)"),
    # translation and printing
    Mutant("negative rational factor loses its sign", C, "return value if sign > 0 else -value", "return value"),
    Mutant("half powers off by one", C, "whole = magnitude.p // 2", "whole = magnitude.p // 2 + 1"),
    Mutant("negative powers not inverted", C, "return value if exponent > 0 else 1 / value", "return value"),
    Mutant("strict for weak inequality swapped", C, "sp.StrictGreaterThan: lambda a, b: b < a", "sp.StrictGreaterThan: lambda a, b: a < b"),
    Mutant("Piecewise branches swapped", C, "ca.if_else(condition, branch, value)", "ca.if_else(condition, value, branch)"),
    Mutant("-(x - y) printed as x - y", G, 'return self._binary("-", node.args[1], node.args[0])', 'return self._binary("-", node.args[0], node.args[1])'),
    Mutant("x + (-y) becomes x + y", G, 'if nb.op == "neg":\n                return self._binary("-", a, nb.args[0])', 'if nb.op == "neg":\n                return self._binary("+", a, nb.args[0])'),
    Mutant("powers of two lost in quotients", G, 'c = c_a * c_b if op == "*" else c_a / c_b', "c = c_a * c_b"),
    Mutant("parentheses of a difference lost", P, 'return f"{left} {op} {self._value(node.args[1], 5)}", 4', 'return f"{left} {op} {self._value(node.args[1], 4)}", 4'),
    Mutant("parentheses of a quotient lost", P, 'return f"{left} {op} {self._value(node.args[1], 6)}", 5', 'return f"{left} {op} {self._value(node.args[1], 5)}", 5'),
    Mutant("numbers with six digits", P, "text = repr(float(value))", 'text = f"{float(value):.6g}"'),
    # C runtime
    Mutant("closed contacts count as open", PROX, "return z <= band;", "return z < -band;"),
    Mutant("ball of twice the radius", PROX, "if (size <= radius + band)", "if (size <= 2 * radius + band)"),
    Mutant("friction along the slip", COULOMB, "w->rows.phi[f + d] = R[f + d] + radius * w->rows.slip[f + d];", "w->rows.phi[f + d] = R[f + d] - radius * w->rows.slip[f + d];"),
    Mutant("radius from a negative percussion", CONTACT, "sg_friction_rows(w, k, f, R, sg_max(sg_radius(w, base, k, R), SG_C(0.0)));", "sg_friction_rows(w, k, f, R, sg_radius(w, base, k, R));"),
    Mutant("radius with mu of another contact", "runtime/c/sg_law_bound.c", "w->mu[k] * R[base", "w->mu[0] * R[base"),
    Mutant("a tolerance that never fires", NEWTON, "if (!(*measure < SG_HUGE)) {", "*measure = SG_C(0.0);\n        if (!(*measure < SG_HUGE)) {"),
    Mutant("open contacts keep their percussion", SYSTEM, "w->newton.dR[k] = -known;", "w->newton.dR[k] = SG_C(0.0);"),
    Mutant("bilateral rows of the border with the wrong sign", SMOOTH, "w->smooth.bordered ? -w->y[", "w->smooth.bordered ? w->y["),
    Mutant("straight-line elimination adds products", "codegen/c/elimination.py", 'return " - ".join([start, *terms])', 'return " + ".join([start, *terms])'),
    Mutant("elimination by tables adds products", "runtime/c/sg_sparse.c", "row[index[m]] -= factor * LU[m];", "row[index[m]] += factor * LU[m];"),
    Mutant("mobility without the pivots", "codegen/program.py", "total += y[i] * y[i] / D[i]", "total += y[i] * y[i]"),
    Mutant("vanishing pivots pass", "runtime/c/sg_sparse.c", "if (!(size * least * scale[i] < SG_C(1.0)) || !(size > SG_C(0.0))) {", "if (0) {"),
    Mutant("the order of elimination is forgotten in a step", NEWTON, "w->x[pr->x + unknown] = w->newton.x_old[unknown] + alpha * w->smooth.dx[i];", "w->x[pr->x + i] = w->newton.x_old[i] + alpha * w->smooth.dx[i];"),
    Mutant("the step of Newton has the wrong sign", SMOOTH, "w->smooth.dx[k] = -w->r[sg_table[pr->K.order + k]];", "w->smooth.dx[k] = w->r[sg_table[pr->K.order + k]];"),
    Mutant("the prox of the velocity problem uses inactive contacts", CONTACT, "(!pr->follows || w->found.active[k] || sg_contacts[k].presser < 0)", "1"),
    Mutant("friction is pressed by the first contact", "runtime/c/sg_law_bound.c", "R[base + SG_NORMAL + contact->pressing]", "R[base + SG_NORMAL]"),
    Mutant("what shares a normal percussion pulls it", "runtime/c/sg_least.c", "pushed += mu * size;", "pushed -= mu * size;"),
    Mutant("a path forgets what else a contact presses", "runtime/c/sg_path.c", "for (; k >= 0; k = sg_contacts[k].next) {", "for (; k >= 0; k = -1) {"),
    Mutant("friction is twice what its coefficient says", "runtime/c/sg_law_bound.c", "? w->mu[k] * R[base", "? SG_C(2.0) * w->mu[k] * R[base"),
    Mutant("a rope leaves the second disc on the other side", "bodies/ropes.py", "(other, scale(-1, along), s - r)", "(other, scale(-1, along), r - s)"),
    Mutant("products of inertia count once", "bodies/spatial.py", "else 2 * J[i][j] * omega[i] * omega[j]", "else J[i][j] * omega[i] * omega[j]"),
    Mutant("the guard is not looked at", STEP, "w->found.exists[k] = !sg_contacts[k].guarded || w->guard[k] >= SG_C(0.0);", "w->found.exists[k] = 1;"),
    Mutant("the guard's sign", STEP, "w->guard[k] >= SG_C(0.0);", "w->guard[k] < SG_C(0.0);"),
    Mutant("only the first stage decides on activity", STEP, "if (last || opt->active_set", "if (slot == 0 || opt->active_set"),
    Mutant("a failed step moves the state", TICK, "        info->status = status;\n        return status;", "        *s = w->trial;\n        s->t += h;\n        info->status = status;\n        return status;"),
    Mutant("a running sum of time", TICK, "w->trial.t = w->trial.t_grid + w->trial.n_grid * h;", "w->trial.t = s->t + h;"),
    Mutant("percussions of substeps overwrite each other", STEP, "info->P[j] += w->P[j];", "info->P[j] = SG_C(0.5) * w->P[j];"),
    Mutant("stale inputs", TICK, "w->u[j] = u[j];", "w->u[j] = u[0];"),
    Mutant("the velocity does not advance", STEP, "sg_copy(SG_N_Q, w->v_end, s->v);", "sg_copy(SG_N_Q, w->v, s->v);"),
    Mutant("scales that depend on units", MASS, "w->masses.root_inertia[j] = SG_SQRT(w->masses.inertia[j] / w->masses.inertia[0]);", "w->masses.root_inertia[j] = SG_C(1.0) + w->masses.inertia[j];"),
    Mutant("no least norm", LEAST, "} else if (sg_may_depend(w, pr)) {", "} else if (0) {"),
    Mutant("rank never revealed", LINALG, "if (!(SG_FABS(beta) > SG_RANK * first)) {", "if (0) {"),
    Mutant("no pivoting", LINALG, "if (size > best) {", "if (best < SG_C(0.0)) {"),
    Mutant("the checker does not look at the momenta", CHECK, "if (!sg_small(w->found.r[i + j], w->scales.momentum_scale[j], SG_C(0.0), limit)) {", "if (0) {"),
    Mutant("the checker does not look at friction", SLIP_CHECK, "return sg_small(bound * slip + power,", "return 1 || sg_small(bound * slip + power,"),
    Mutant("the checker misses skipped impacts", CHECK, "if ((must && !w->found.active[k]) ||", "if ("),
    Mutant("penetration at the start is accepted", SIMULATE, "if (at->value[n] < SG_C(0.0) &&", "if (0 &&"),
    Mutant("records shifted by a row", SIMULATE, "const int first = (step % every + begun) % every == 0;", "const int first = (step % every + begun) % every == every - 1;"),
    # full order, Moreau, sizes of terms, bodies
    Mutant("the force at the start times h twice", FULL, "return self.start_percussion", "return self.h * self.start_percussion"),
    Mutant("a_hat for a in the auxiliary velocities", FULL, 'r_i = r_i - self.a(i, j) * self.at(j, "F")', 'r_i = r_i - self.a_hat(i, j) * self.at(j, "F")'),
    Mutant("start force with the wrong sign of the rates", FULL, "y = W.T @ dv + self.h * rate", "y = W.T @ dv - self.h * rate"),
    Mutant("a force that is carried along", STEP, "status = sg_solve(w, s, par, opt, info, problem, warm, effort, end);", "status = SG_N_GAMMA > 0 && SG_N_CONTACTS == 0 && problem == 0 && s->warm > 0 ? SG_K(OK) : sg_solve(w, s, par, opt, info, problem, warm, effort, end); if (SG_N_GAMMA > 0 && SG_N_CONTACTS == 0 && problem == 0 && s->warm > 0) { sg_copy(SG_N_R, &s->R[SG_N_ROWS_TOTAL - 2 * SG_N_R], w->R); }"),
    # numbers, reports
    Mutant("a bound is no force", D, 'return size + self["bound_force"]', "return size"),
    Mutant("percussions of touching contacts have no round-off", NORMAL_CHECK, "own + w->masses.m_eff[n]", "own + SG_C(0.0) * w->masses.m_eff[n]"),
    Mutant("no start after a rejected one", SOLVE, "attempt < SG_ATTEMPTS && status != SG_K(OK) &&", "attempt < SG_ATTEMPTS && status != SG_K(OK) && status != SG_K(REJECTED) &&"),
    Mutant("the checker is not asked", SOLVE, "status = sg_check_problem(w, opt, problem) ? SG_K(OK) : SG_K(REJECTED);", "status = SG_K(OK);"),
    Mutant("percussions of least norm pull", LEAST, "z[a] = sg_max(before, SG_C(0.0));", "z[a] = before;"),
    Mutant("percussions of least norm leave the friction cone", LEAST, "for (d = 0; d < sg_contacts[i].components && size > most; ++d) {", "for (d = 0; d < 0; ++d) {"),
    Mutant("projections do not remember what they left out", LEAST, "w->least.correction[a] += z[a];", "w->least.correction[a] = z[a];"),
    Mutant("a time that the user sets is overwritten", TICK, "s->t != s->t_grid + s->n_grid * s->h_grid", "0"),
    Mutant("a guard that is no number counts as open", STEP, " || !sg_all_finite(SG_N_CONTACTS, w->guard)", ""),
    Mutant("percussions of a row are the last step's", SIMULATE, "to->P[row * SG_N_R + k] + info->P[k]", "info->P[k]"),
    Mutant("resting contacts have impacts", STEP, "return rate < -SG_CHECK * w->scales.speed[n];", "return rate < SG_C(1.0);"),
    Mutant("a slip backwards is forwards", STEP, "slip[0] < SG_C(0.0) ? SG_K(SLIP_BACK)", "slip[0] < SG_C(0.0) ? SG_K(SLIP)"),
    Mutant("impacts have no energy", SIMULATE, "energy - before->energy", "SG_C(0.0)"),
    Mutant("unstable steps are called stable", "runtime/c/sg_stable.c", "K[i] = -(K[i] + part[i]);", "K[i] = K[i] + part[i];"),
    Mutant("constraints do not count for the stable step", "runtime/c/sg_stable.c", "sg_orthonormal(SG_N_Q, m, Q);", "sg_fill(SG_N_Q * m, SG_C(0.0), Q);"),
    Mutant("corners meet edges that they do not face", "bodies/polygons.py", "algebra.minimum(inside, _fold(algebra.maximum, terms))", "inside"),
    Mutant("ends of the reference edge meet nothing", "bodies/polygons.py", "terms.append(algebra.minimum(leads[1 - side][k], incident))", "pass"),
    Mutant("an edge counts behind itself up to its ends", "bodies/shapes.py", "inside + edge.beyond + behind", "inside + edge.beyond"),
    Mutant("theta and 1 - theta change places", "codegen/schemes/theta.py", "(1 - theta) * forces[0] + theta * forces[1]", "theta * forces[0] + (1 - theta) * forces[1]"),
    Mutant("theta-method: force not differentiated in q", "codegen/schemes/theta.py", " + h * theta * slope[\"force_q\"]", ""),
    Mutant("a table's cell one too low", "runtime/c/sg_cell.c", "return low;", "return low > 0 ? low - 1 : 0;"),
    Mutant("a table's end cell with the cubic term", "codegen/frontend/table.py", "np.vstack([beyond, c3, beyond])", "np.vstack([c3[:1], c3, c3[-1:]])"),
    Mutant("Moreau's middle at the end", "codegen/schemes/moreau.py", "self.q_n + self.h / 2 * self.v_n", "self.q_n + self.h * self.v_n"),
    Mutant("open contacts act in Moreau's scheme", "codegen/schemes/moreau.py", "else -gap", "else gap"),
    Mutant("force without dp/dt", D, ' - self["p_t"])', ")"),
    Mutant("terms of a difference cancel", "codegen/derive/magnitude.py", "ca.OP_SUB: lambda a, b: a + b", "ca.OP_SUB: lambda a, b: a - b"),
    Mutant("planar turn with the wrong sign", "bodies/frames.py", "return (-omega * vector[1], omega * vector[0])", "return (omega * vector[1], -omega * vector[0])"),
    Mutant("support point of the ellipsoid outside", "bodies/shapes.py", "reach = scale(-1 / height", "reach = scale(1 / height"),
    Mutant("torques without reaction", "bodies/scene.py", "spin = frame.spin if against is None else subtract(frame.spin, against.spin)", "spin = frame.spin"),
    Mutant("the spin of a body in space has a wrong sign", "bodies/spatial.py", "((-p1, p0, -p3, p2),", "((-p1, p0, p3, p2),"),
    Mutant("a loop takes every entry where it should take every second", "codegen/c/loops.py", 'step = "k" if stride == 1', 'step = "k" if stride <= 2'),
    # anisotropic friction
    Mutant("percussions of an ellipse are taken for those of a disc", "runtime/c/sg_law_elliptic.c", "return R / w->elliptic.axis[c];", "return R;"),
    Mutant("the slip of an ellipse is taken for that of a disc", "runtime/c/sg_law_elliptic.c", "return x * w->elliptic.axis[c];", "return x;"),
    Mutant("the checker takes an ellipse for a disc", "runtime/c/sg_law_elliptic_check.c", "force[d] = (*R)[d] * w->mu[k] / mu;", "force[d] = (*R)[d];"),
    Mutant("the slip direction turns as on a disc", COULOMB, "sg_over_axis(w, c_e, sg_over_axis(w, c_e, w->rows.slip[other]))", "sg_over_axis(w, c_e, w->rows.slip[other])"),
    # paths and other rescues
    Mutant("friction along the slip on a path", PATH, "R[f + d] = -w->mu[k] * w->rows.slip[f + d] *", "R[f + d] = w->mu[k] * w->rows.slip[f + d] *"),
    Mutant("velocities move against the percussions of a path", LINEAR, "w->smooth.dx[i] -= w->system.Z[a * pr->n_border + i] * step;", "w->smooth.dx[i] += w->system.Z[a * pr->n_border + i] * step;"),
    Mutant("folds of a path ignored", PATH, "way = sg_path_way(w, &event);", "way = SG_C(-1.0);"),
    Mutant("a path leaves the cone on its far side", COULOMB, "return first < second ? first : second;", "return first < second ? second : first;"),
    Mutant("a path ends before tau is zero", PATH, "arrived = way < SG_C(0.0) && next.at >= tau;", "arrived = way < SG_C(0.0);"),
    Mutant("contacts never close on a path", SIGNORINI, "*what = SG_CLOSES;", "*what = SG_OPENS;"),
    Mutant("left-out contacts keep their percussion", CONTACT, "if (!sg_joins(w, pr, k)) {", "if (0) {"),
    Mutant("iterations not bounded", SOLVE, "return left < wish ? left : wish;", "return wish + 0 * left;"),
    Mutant("no path is followed", SOLVE, "if (!sg_path(w, par, opt, problem, turn)) {", "if (1 || !sg_path(w, par, opt, problem, turn)) {"),
    Mutant("friction along the slip on a central path", CENTRAL, "w->central.rows[row] += radius * s.slip[d] / s.size", "w->central.rows[row] -= radius * s.slip[d] / s.size"),
    Mutant("folds of a central path ignored", CENTRAL, "(agree < SG_C(0.0) ? SG_C(-1.0) : SG_C(1.0)) / length", "(agree < SG_C(2.0) * length ? SG_C(-1.0) : SG_C(1.0)) / length"),
    Mutant("gaps of a central path pull", SIGNORINI, "return SG_C(0.5) * (z + size);", "return SG_C(0.5) * (z - size);"),
    Mutant("a central path does not know how wide gaps are", SIGNORINI, "scale * (w->central.wider[n] * *share -", "scale * (-w->central.wider[n] * *share -"),
    Mutant("a central path ends far from the laws", CENTRAL, "if (e < end) {", "if (e < SG_CENTRAL_START) {"),
    Mutant("percussions stay outside their cones", CONTACT, "if (sg_into_cone(contact->components, w->mu[k], unit,", "if (0 && sg_into_cone(contact->components, w->mu[k], unit,"),
    Mutant("the judge looks at normal percussions only", "stress/judge.py", "outside = np.maximum(size - radius, 0) / force", "outside = 0 * np.maximum(size - radius, 0) / force"),
    Mutant("the judge takes any sign of friction", "stress/judge.py", 'np.einsum("ij,ij->i", P, slip)', '-np.abs(np.einsum("ij,ij->i", P, slip))'),
    Mutant("enumeration without slip to one side", "stress/enumeration.py", "(OPEN, STICK, FORTH, BACK)\n            if", "(OPEN, STICK, FORTH)\n            if"),
    Mutant("enumeration takes friction along the slip", "stress/enumeration.py", "{OPEN: 0.0, FORTH: 1.0, BACK: -1.0}", "{OPEN: 0.0, FORTH: -1.0, BACK: 1.0}"),
    Mutant("friction that follows the normal percussion has the wrong sign", COULOMB, "? -(w->rows.slip[f] * mu)", "? w->rows.slip[f] * mu"),
    Mutant("a repeated exponential loses its sign", C, "ca.exp(rest if factor > 0 else -rest)", "ca.exp(rest)"),
    Mutant("a shared term is taken for another", "codegen/sharing.py", '("common", i)', '("common", 0 * i)'),
    Mutant("a term of a place is taken for another", "codegen/sharing.py", "Ref(array, len(column), ARGUMENT)", "Ref(array, 0 * len(column), ARGUMENT)"),
    Mutant("a term of a place loses its sign", "codegen/sharing.py", "symbol if sign == own else -symbol", "symbol if sign == own else symbol"),
    Mutant("terms of a stage at t_n", L, '(self.time(i), Ref("Q"', '(Time(0.0), Ref("Q"'),
    Mutant("terms in the state are used whatever changed", STEP, "s->has_terms = s->has_terms && s->key[k] == w->key[k];", "s->has_terms = s->has_terms && s->key[k] == s->key[k];"),
    Mutant("terms of another stage are kept for the next step", STEP, "&w->terms[(SG_N_STAGES - 2) * SG_N_TERMS]", "&w->terms[0]"),
    Mutant("a last attempt keeps less than the checker lets", NEWTON, "ends && pr->gap_slots > 0 ? SG_C(4.0)", "ends && pr->gap_slots > 0 ? SG_C(1.0)"),
    Mutant("a product with a reciprocal loses the divisor", G, 'self._add(Node("inv", (args[1],)))', 'self._constant(1.0)'),
    Mutant("no iterations kept for substeps", STEP, "effort == SG_AGAIN && opt->max_halvings > 0 ? SG_PART_AGAIN", "effort == SG_SUBSTEP ? SG_PART_AGAIN"),
    Mutant("the rescues of a given-up step stay", STEP, "    sg_reset_info(info);\n    info->iterations = used;", "    info->iterations = used;"),
    Mutant("contacts are never said to hold", STEP, "effort = SG_AGAIN;", "effort = SG_SUBSTEP;"),
    Mutant("a sift that rules out what pushes little", "stress/sift.c", "if (kind[j] != OPEN && R[j] < -slack) {", "if (kind[j] != OPEN && R[j] < slack + push / 2.0) {"),
    Mutant("what is known has the value of something else", G, "place |= {k: place[by] for k, by in known.items()}", "place |= {k: place[max(known.values())] for k in known}"),
    Mutant("arrows of contacts point into the obstacle", "bodies/looks.py", "tips = [add(place, arm) for arm", "tips = [add(place, scale(-1, arm)) for arm"),
    Mutant("a frame shows the percussion of its own row alone", "view/motion.py", "before = np.concatenate([[0], shown[:-1]])[which]", "before = np.maximum(rows - 1, 0)"),
    Mutant("a hit is drawn where the body is at the frame's time", "view/motion.py", "contacts[name][_frames_of(rows, hits[name])] = own", "contacts[name][_frames_of(rows, hits[name])] += 0 * own"),
    Mutant("impacts give energy in the plot", "view/plots.py", "axis.step(self.t, -taken,", "axis.step(self.t, taken,"),
    Mutant("an environment holds an action for one step", "api/learning.py", "sim.step(u, self.steps)", "sim.step(u, 1)"),
    Mutant("a contact bounces for ever", IMPACT, "            w->e_N[k] = SG_C(0.0);", "            w->e_N[k] *= SG_C(1.0);"),
    Mutant("friction of a segment's first stage goes along the slip", "runtime/c/sg_modes.c", "? -(w->segment.mu[k] * w->segment.direction[f])", "? (w->segment.mu[k] * w->segment.direction[f])"),
    Mutant("an event is taken where it was first looked for", LOCATED, "(falls && (SG_FABS(next - tau) <= noise || high - low <= noise))", "round >= 0"),
    Mutant("events do not move in time", FORWARD, ": -(d->event[j] / d->event[last]);", ": SG_C(0.0);"),
    Mutant("friction does not change with its coefficient", "runtime/c/sg_directions.c", "radius = f->mu[sg_slips[c].contact] *", "radius = SG_C(0.0) *"),
    Mutant("grazing contacts are differentiated", "runtime/c/sg_real.h", "#define SG_STEEP SG_C(0.0001220703125)", "#define SG_STEEP SG_C(0.0)"),
    Mutant("parameters stand for their changes", "codegen/c/refs.py", 'return "par" if value.owner == WORK else f"&{_OWNERS[value.owner]}par"', 'return "par"'),
    Mutant("changes of fields are those of their neighbours", "codegen/forward.py", "self.twins[point].stored(name).index(nonzero)", "0"),
    Mutant("forces end where the stages see them last", "runtime/c/sg_real.h", "#define SG_CLEAR_GROWTH SG_C(2.0)", "#define SG_CLEAR_GROWTH SG_C(0.0)"),
    Mutant("contacts without force stay closed", LOCATED, "            sg_impose_open(w, k);\n            return k;", "            return -1;"),
    Mutant("nobody hears that a step was captured", LOCATED, "info->captured = done > SG_C(0.0) ? 1 : 2;", "info->captured = 0;"),
    Mutant("velocity constraints are without force at a segment's start", "runtime/c/sg_segment.c", "w->given[c] = part * w->segment.force[SG_N_G + c];", "w->given[c] = SG_C(0.0);"),
    Mutant("gaps are looked at at the ends of a segment alone", "runtime/c/sg_events.c", "j <= SG_SAMPLES && near", "j <= SG_SAMPLES && near && 0 * j"),
    Mutant("the estimate of a step is that of another order", ADVANCE, "sg_gain() - SG_C(1.0)", "sg_gain() * sg_gain()"),
    Mutant("parts of a step share the segment behind an event", ADVANCE, "c->parts[n] = SG_C(0.5) * (begin + end);\n            ++n;", "c->parts[n] = SG_C(0.5) * (begin + end);"),
    Mutant("errors of velocities are left out of the estimate", ADVANCE, "const real rates = c->span *", "const real rates = SG_C(0.0) *"),
    Mutant("estimates do not add up", ADVANCE, "c->estimate += error;", "c->estimate = error;"),
    Mutant("a step is accepted whatever its error is", ADVANCE, "if (error <= allowed || h <= least)", "if (error <= allowed || h > least)"),
    Mutant("percussions of the parts of a step are lost", ADVANCE, "sum->P[k] += part->P[k];", "sum->P[k] = part->P[k];"),
    Mutant("percussions of a located impact are lost", IMPACT, "w->segment.P[k] += P[k];", "w->segment.P[k] += SG_C(0.0) * P[k];"),
    Mutant("a segment tests the slip at its IIIB velocities", "codegen/schemes/located.py", 'own = self.aux(j, "gamma_F") if j', 'own = self.at(j, "gamma_F") if j'),
    Mutant("accelerations without the turn of contact directions", "codegen/schemes/located.py", '("g_rate", "gamma_rate", "g_N_rate", "gamma_F_rate")]\n        y = self.h *', '("g_rate", "gamma_rate", "g_N_rate", "gamma_F_rate")]\n        y = 0 * self.h *'),
    Mutant("a gradient by the step size is of the last step", "runtime/c/sg_adjoint.c", "back.h = a->h + sg_pull(d, a, j);", "back.h = sg_pull(d, a, j);"),
    Mutant("a block of the derivative is transposed", "runtime/c/sg_adjoint.c", "sum += a->q[i] * d->q[j * SG_N_Q + i]", "sum += a->q[i] * d->q[i * SG_N_Q + j % SG_N_Q]"),
    Mutant("states that are kept are forgotten", "runtime/c/sg_adjoint.c", "    *now = kept[*top];", "    *now = kept[0];\n    now->step = kept[*top].step;"),
    Mutant("the second problem does not hear of the first", "runtime/c/sg_forward_map.c", "for (p = 0; p < problem; ++p) {", "for (p = problem; p < problem; ++p) {"),
    Mutant("a stage does not change with the parameters", "codegen/forward.py", "x = ca.vertcat(*(self.symbols[name] for name in names))", 'x = ca.vertcat(*(self.symbols[name] for name in names if name != "par"), ca.SX.sym("none", self.symbols["par"].numel() if "par" in names else 0))'),
    Mutant("velocities move nothing", "runtime/c/sg_forward_step.c", "idle = idle && d->v[j * SG_N_Q + i] == SG_C(0.0) &&", "idle = idle &&"),
    Mutant("a mode at its limit has a derivative", "runtime/c/sg_forward_place.c", "            !d->jumps[k]) {", "            d->jumps[k] < 0) {"),
    Mutant("an impact concerns its own body alone", "codegen/derive/influence.py", "{group_of[i], *contacts}", "{group_of[i]}"),
    Mutant("nearest is measured without masses", "runtime/tangent.py", "root = np.linalg.inv(np.linalg.cholesky((M + M.T) / 2)).T", "root = np.eye(len(M))"),
    Mutant("a ghost of the last direction stays", "runtime/c/sg_forward_step.c", "sg_copy(SG_N_PAR, &d->par[j * SG_N_PAR], &own->par[n * SG_N_PAR]);", "sg_copy(SG_N_PAR, &d->par[0], &own->par[n * SG_N_PAR]);"),
    Mutant("a batch has the parameters of its first run", "runtime/changes.c", "SG(step_forward)(&m->state, &m->work, &m->info, &c->params[k]", "SG(step_forward)(&m->state, &m->work, &m->info, &c->params[0]"),
    Mutant("between the rows a run takes a step too many", "runtime/between.py", "time - t - whole * self.h)", "time - t)"),
)  # fmt: skip
