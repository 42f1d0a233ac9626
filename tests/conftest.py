"""Options and shared steppers of the test suite."""

import os
import re
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import signorini as sg

sys.path.insert(0, str(Path(__file__).resolve().parent))
import branch_coverage

ROOT = Path(__file__).resolve().parent.parent

# A cache of its own: nothing compiled earlier may hide a fault.
os.environ.setdefault(
    "SIGNORINI_CACHE",
    str(Path(tempfile.gettempdir()) / f"signorini-tests-{os.getppid()}"),
)
# Most of the suite's time is compilation, and few tests run long.
os.environ.setdefault("SIGNORINI_CFLAGS", "-O0")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="rewrite the golden steppers in generated/"
    )


# Analysers, other compilers, and mechanisms that have a cheaper test in the first circle.
FURTHER = re.compile(
    "|".join(
        (
            r"test_elliptic.py::test_(equal_coefficients|the_path_bends.*\[3)",
            r"test_view.py::test_a_surface_in_space",
            r"test_fmu.py::test_calls_in_any_order",
            r"test_derivatives.py::test_models_without_contacts\[model1",
            r"test_new.py::test_a_new_file_runs_and_is_drawn\[(space|lagrangian|casadi)",
            r"test_new.py::test_inputs_of_the_command_line",
            r"test_view.py::test_arrows.*(woodpecker|slider_crank|rocking_block|box_in_space)",
            r"test_view.py::test_(legends_cover|friction_of_contacts|titles_do_not)",
            r"test_documentation.py::test_blocks_run",
            r"test_elliptic.py::test_the_ellipse_is_a_disc",
            r"test_polygons.py::test_(a_notch|a_tilted.*0.03|random_stacks)",
            r"test_derivatives.py::test_(two_contacts|a_struck|where_a_bounce|a_grazing)",
            r"test_derivatives.py::test_(outputs_change|an_impact_that_sl)",
            r"test_adjoint.py::test_gradients_of_inputs",
            r"test_linearise.py::test_(the_multiplier_of|a_bounce_on)",
            r"test_optimisers.py::test_(a_hopper|an_identification|a_bounce_shot)",
            r"test_laws.py::test_(a_roller_stops.*3|derivatives_of|a_ball_rolls|one_contact)",
            r"test_laws.py::test_(a_captured_servo|stick_and_slip|friction_that|a_coefficient_that)",
            r"test_laws.py::test_(restitution_of|mecanum|a_spinning)",
            r"test_loads.py::test_a_bead",
            r"test_compliance.py::test_the_rigid_limit",
            r"test_stability.py::test_a_loaded_string",
            r"test_linearise.py::test_a_disc_that_rolls",
            r"test_stress.py::test_velocities_of_stages",
            r"test_full_order.py::test_(a_sleigh_settles|energy_and_force)",
            r"test_rest.py::test_(contacts_that_touch|a_wall_that_is_touched)",
            r"test_stress.py::test_runs_that_once_stopped\[groove-2",
            r"test_tolerance.py::test_rows_of_a_grid",
            r"test_expressions.py::test_the_norm.*casadi",
            r"test_bodies.py::test_gears_roll",
            r"test_poisson.py::test_(what_rests|a_cradle)",
            r"test_laws.py::test_(a_captured_stop|a_freewheel_is|resistance_acts|the_limit_cycle)",
            r"test_ropes_and_gears.py::test_(block_and|atwoods)",
            r"test_laws.py::test_(a_roller_rests|coefficients_at_the_stages_have.*3-options3)",
            r"test_generated_code.py::test_sanitizers",
            r"test_hostile.py::test_(fuzz|valgrind)",
            r"test_packaging.py::test_wheel_and_sdist",
            r"test_firmware.py::test_(make_and|stated_memory)",
            r"test_generated_code.py::test_no_warnings(?!.*located.*double|.*only_libm.*mixed_contacts-double)",
            r"test_files.py::test_a_killed",
            r"test_(studies|sweep).py::test_(command|period_doubling)",
        )
    )
)


# Further instances of a mechanism of which continuous integration has one, and the same on more
# models or machines.
SLOWER = re.compile(
    "|".join(
        (
            r"test_collection.py::test_(andrews|arch|block_stack|chain_presses|domino|drawer)",
            r"test_collection.py::test_(four_bar|groove|hopper|pendulum_vibrates|prism|rimless)",
            r"test_collection.py::test_(rocking|woodpecker|cradle\[[24]|painleve.*\[3)",
            r"test_collection.py::test_runs_to_its_horizon\[(four_bar|table_with_legs|andrews)",
            r"test_collection.py::test_runs_to_its_horizon\[(prism|drawer|falling|dominoes|block)",
            r"test_located.py::test_(order_through_events\[two|three_balls)",
            r"test_bodies.py::test_(planar_joints|spatial_joints|springs.*|the_same_boxes)\[casadi",
            r"test_bodies.py::test_top_in_two_sets_of_coordinates\[casadi",
            r"test_full_order.py::test_(sleigh|turntable)_orders\[[45]",
            r"test_full_order.py::test_(coin_orders\[3|a_sleigh_settles\[[34]|steps.*-4)",
            r"test_stability.py::test_no_false_alarm\[(?!vibrating)",
            r"test_stability.py::test_the_warning_names_a_stable_step\[[45]",
            r"test_steps.py::.*(mixed_contacts|one_coordinate|only_constraints|sticking.*|uncon.*)-4",
            r"test_benchmarks.py::test_(ball_slides.*|slope_has.*|slider_crank)\[[45]",
            r"test_check.py::test_(waivers|every_form_is_checked_and_named.*options[34])",
            r"test_check.py::test_models_pass\[trap_models\.(one_coordinate|unconstrained|only)",
            r"test_files.py::test_(models_called_like_files\[(ex|fe|st)|a_killed.*True)",
            r"test_bench.py::test_command",
            r"test_rolling.py::test_a_rattleback_turns_back\[3",
            r"test_from_sympy.py::test_names_that_c_lacks",
            r"test_studies.py::test_study\[(energy|lost|orders)",
            r"test_runtime_files.py::test_long_models.*\[1",
            r"test_stability.py::test_several_frequencies",
            r"test_collection.py::test_turntable_circle",
            r"test_tables.py::test_functions_in_c\[casadi",
            r"test_tolerance.py::test_(time_in_the_forces|what_cannot_be_had)",
            r"test_commands_for_models.py::test_growth",
            r"test_theta.py::test_orders",
            r"test_moreau.py::test_steps_satisfy_the_equations\[rheonomic",
            r"test_stress.py::test_what_is_left_of_the_iterations",
            r"test_collection.py::test_runs_to_its_horizon\[(coin|box)-2",
            r"test_steps.py::test_steps.*(one_coord|unconstrained|only_constr|sticking_incl).*-2",
            r"test_steps.py::test_jacobians.*position-(slider_crank.model|trap_models.rheonomic)-4",
            r"test_studies.py::test_study\[(reversibility|bilateral)",
            r"test_theta.py::test_(a_linear_oscillator_is_a_matrix\[1.0|orders\[1-1)",
            r"test_stress.py::test_runs_that_once_stopped\[(groove-3-25|chain-2-1)",
            r"test_stability.py::test_the_warning_names_a_stable_step\[3",
            r"test_moreau.py::test_steps_satisfy_the_equations\[only",
            r"test_full_order.py::test_steps_satisfy_the_equations\[driven-2",
            r"test_theta.py::test_a_linear_oscillator_is_a_matrix\[0.7",
            r"test_full_order.py::test_(sleigh|turntable)_orders\[3",
            r"test_collection.py::test_(sphere_sticks|bead_settles|turntable_circle)",
            r"test_robustness.py::test_two_hundred_box_drops\[4",
            r"test_hostile.py::test_hostile_names_do_not_get_out\[if",
            r"test_bodies.py::test_two_polygons_collide",
            r"test_check.py::test_models_pass\[box.model",
            r"test_located.py::test_order_through_events\[knife",
            r"test_bodies.py::test_top_in_two_sets",
            r"test_runs.py::test_extended_precision",
            r"test_collection.py::test_runs_to_its_horizon\[(atwood|freewheel|kanes|rattling|roll)",
            r"test_collection.py::test_runs_to_its_horizon\[(screw|servo|string|stribeck|woodp)",
            r"test_collection.py::test_runs_to_its_horizon\[(vibrating|rimless|ribbed|sphere)",
            r"test_steps.py::test_steps_satisfy.*(box|slope).model-[45]",
            r"test_steps.py::test_steps_satisfy.*(unconstr|only_constr|one_coord|sticking_inc).*-5",
            r"test_stability.py::test_where_the_scheme_begins_to_amplify\[[346]",
            r"test_full_order.py::test_coin_orders\[4",
            r"test_steps.py::test_jacobians.*position-trap_models.(one_coord|only_con|sticking|unconstr).*-2",
            r"test_steps.py::test_steps_satisfy.*(mixed_contacts|rheonomic)-2",
            r"test_rest.py::test_a_bound_is_a_force\[2",
            r"test_runs.py::test_a_lift_carries_its_load\[3",
            r"test_stress.py::test_runs_that_once_stopped\[groove-3-32",
            r"test_theta.py::test_the_check_passes",
            r"test_full_order.py::test_steps_satisfy.*only_constraints-2",
            r"test_files.py::test_models_called_like_files\[manifest",
            r"test_stress.py::test_scenes\[3-vibrating",
            r"test_generated_code.py::test_static_analysis\[(?!.*slope.*located)",
            r"test_generated_code.py::test_no_warnings_and_only_libm\[box_in_space",
            r"test_generated_code.py::test_sanitizers\[box_in_space",
            r"test_targets.py::test_float_is_single_throughout\[(box_in|slider|bouncing)",
            r"test_targets.py::test_same_trajectory\[box_in_space.*wasm",
            r"test_runtime_files.py::test_the_default_library.*names1",
            r"test_tolerance.py::test_shipped_models.*\[(bouncing|slope|rocking|andrews|hopper|bead)",
            r"test_eva.py::test_linear_algebra_and_prox\[model1",
            r"test_targets.py::test_same_trajectory\[box_in_space.*(aarch64|s390x|M4F|M7)",
            r"test_examples.py::test_models_and_instances_in_threads\[address",
            r"test_tolerance.py::test_shipped_models.*\[four_bar",
            r"test_hostile.py::test_compilers_and_contraction\[box_drop",
            r"test_firmware.py::test_stated_memory\[box_in_space.*float",
            r"test_targets.py::test_memory_on_a_microcontroller\[(double|float-M7)",
            r"test_located.py::test_an_elastic_ball_keeps_energy_and_time\[100000",
            r"test_laws.py::test_pressed_friction_is_checked.*(moreau|float|captured)",
            r"test_stability.py::test_no_false_alarm\[(?!vibrating|coin|hopper|four|arch|slider)",
            r"test_laws.py::test_one_way_velocities_are_checked\[options[12]",
            r"test_loads.py::test_loads_are_checked\[(model|hoop-options1)",
            r"test_laws.py::test_coupled_laws_are_checked\[options[01]",
            r"test_poisson.py::test_what_check_says_of_poisson.*options[02]",
            r"test_laws.py::test_coefficients_at_the_stages_are_checked\[options[023]",
            r"test_collection.py::test_runs_to_its_horizon\[(atwood|freewheel|kanes|rat|screw|servo|str)",
            r"test_collection.py::test_runs_to_its_horizon\[bicycle",
            r"test_studies.py::test_study\[law",
            r"test_new.py::test_a_new_file_runs_and_is_drawn\[space",
            r"test_firmware.py::test_stated_memory\[box_in_space",
            r"test_generated_code.py::test_static_analysis\[slope.*located",
            r"test_stress.py::test_sanitizers",
            r"test_check.py::test_models_pass\[trap_models.mixed_contacts",
            r"test_poisson.py::test_what_check_says_of_poissons_law\[options1",
            r"test_parts.py::test_boxes_in_space.*(2|64)\]",
            r"test_c_units.py::test_branches",
            r"test_notebooks.py::test_notebooks_run\[identification",
            r"test_view.py::test_a_page_in_space",
            r"test_located.py::test_the_command_line_locates_events",
            r"test_parts.py::test_assorted_parts_are_checked",
            r"test_generated_code.py::test_no_warnings_in_located_steps\[model-double",
            r"test_generated_code.py::test_sanitizers\[(slider|bouncing|slope|.*only_c|.*tabul)",
            r"test_compliance.py::test_compliance_is_checked\[yielding-stages0-options0",
            r"test_c_units.py::test_located_steps_of_any_model\[(rheonomic|anisotropic)",
            r"test_check.py::test_a_flipped_sign_fails\[<lambda>",
            r"test_targets.py::test_same_trajectory\[slider_crank.*(wasm|M4F)",
            r"test_targets.py::test_float_is_single_throughout\[slope",
            r"test_bicycle.py::test_eigenvalues_of_the_benchmark_bicycle\[0.0",
        )
    )
)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Tests with these markers run only when asked for by the marker."""
    for item in items:
        if SLOWER.search(item.nodeid):
            item.add_marker(pytest.mark.slow)
        elif FURTHER.search(item.nodeid):
            item.add_marker(pytest.mark.thorough)
    chosen = config.option.markexpr or ""
    reasons = {
        "slow": "a long study: run with -m slow",
        "thorough": "another machine, compiler or analyser: run with -m thorough",
    }
    for item in items:
        marker = next((m for m in reasons if m in item.keywords), "")
        if marker and marker not in chosen:
            item.add_marker(pytest.mark.skip(reason=reasons[marker]))


@pytest.fixture(scope="session")
def ink() -> Callable[[Path], tuple[float, float, float, int]]:
    """What a picture shows: shares of inked pixels, of the width and height that they span, and the
    number of their colours that cover more than a thousandth of the ink."""

    def look(path: Path) -> tuple[float, float, float, int]:
        import matplotlib.image
        import numpy as np

        image = np.asarray(matplotlib.image.imread(path), dtype=float)[..., :3]
        inked = image.min(axis=2) < 0.94
        spans = [np.ptp(np.flatnonzero(inked.any(axis=k))) / inked.shape[1 - k] for k in (0, 1)]
        _, counts = np.unique(np.round(4 * image[inked]), axis=0, return_counts=True)
        return (
            float(inked.mean()), float(spans[0]), float(spans[1]),
            int(np.count_nonzero(counts > 1e-3 * inked.sum())),
        )  # fmt: skip

    return look


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def stepper() -> Callable[..., sg.Stepper]:
    """Build a stepper once per test process: ``stepper(model_function, stages)``."""

    @cache
    def make(model: Callable[[], sg.Model], stages: int = 3, **options: Any) -> sg.Stepper:
        return sg.build(model(), stages=stages, **options)

    return make


_BEGIN = time.time()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """What the run cost; branches of the C runtime that its unit tests took in it."""
    if not hasattr(terminalreporter.config, "workerinput"):
        made = (Path(os.environ["SIGNORINI_CACHE"]) / "compiled").glob("*.sha256")
        count = sum(path.stat().st_mtime >= _BEGIN for path in made)
        cpu = sum(os.times()[:4])
        terminalreporter.write_line(f"{count} steppers compiled, {cpu:.0f} CPU seconds")
    if any("test_branches" in r.nodeid for r in terminalreporter.getreports("passed")):
        terminalreporter.section("branches of runtime/c taken by its unit tests")
        terminalreporter.write(branch_coverage.REPORT.read_text())
