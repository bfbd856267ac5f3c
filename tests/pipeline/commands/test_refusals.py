"""Mistakes on the command line: each is one line on stderr, and nothing is written."""

import shlex

import pytest

import diagnose.cli
import gensig.cli

MAIN = {"gensig": gensig.cli.main, "diagnose": diagnose.cli.main}
SLICED = "system=helical_pair mesh.n_slices=12 mesh.slice_coupling=independent mesh.contact=linear"
HOT = f"gear=chongqing_40_162 heat=chongqing_rated {SLICED}"
TRAIN = "system=engine_gear_train"
ENGINE = f"{TRAIN} excitation=engine_v20"
STEADY = f"gensig forced-response {ENGINE}"
TUNE = "gensig tune-damper --out damped.yaml"
PUMP = f"{TUNE} {ENGINE} --mesh 21 45"
DAMPERS = f"gensig modes {TRAIN} system.dampers="
SHEET = "--teeth 20 45 --module 3 --speed 1500 --torque 60"
NEW = f"gensig new gearbox mine {SHEET}"
STAGES = "gensig new gearbox mine --teeth 29 100 36 90 --module 1.5 2 --speed 1500 --torque 10"
RAMP = "operating=ramp operating.duration_s=0.2"
ORDERS = "gensig simulate --orders r.csv operating.duration_s"
FIGURES = "gensig figures --dir figures"
WORN = (
    "gensig wear-life operating.duration_s=0.1 sensing.channels=[pinion_y,wheel_y] "
    "wear.threshold_um=40"
)
DETECT = "diagnose detectability fault=crack"
FLANK = f"gensig modify-flank {SLICED}"
ERROR = f"gensig transmission-error {SLICED}"


def uniform(key):
    """An override that varies one key."""
    return f"'plan.vary={{{key}: {{distribution: uniform, low: 1, high: 2}}}}'"


def damper(node=45, inertia=0.01, damping=1):
    """A list of one damper without a spring."""
    sizes = f"ring_inertia_kg_m2: {inertia}, damping_nms_per_rad: {damping}"
    return f"{DAMPERS}'[{{node: {node}, {sizes}, stiffness_nm_per_rad: 0}}]'"


REFUSED = {
    # verbs and flags
    "gensig generat": "did you mean 'generate'?",
    "gensig train data=x": "a command of diagnose",
    "gensig fault=crack": "stands behind a command",
    "gensig verify": "missing: DIR",
    "gensig verify x --quik": "did you mean '--quick'?",
    "gensig verify x y": "'y' is one word too many",
    "gensig reproduce x --records many": "x does not exist",
    "gensig root-stress --stress much": "--stress much is not a number",
    "gensig stiffness --jsn x": "gensig stiffness --help",
    "gensig stiffness -plot x.png": "did you mean '--plot'?",
    "gensig generate --fault=crack out=x": "no dashes: fault=crack",
    "gensig wear-life --torques 10 20 fault=wear": "key=value words stand before --torques",
    "gensig forced-response --run 650 1750": "--run needs LOW HIGH STEP",
    "gensig modify-flank": "missing: --out FILE",
    "gensig completion powershell": "is not one of bash, zsh, fish",
    "gensig options falt": "did you mean 'fault'?",
    "gensig options crack": "gensig options fault=crack",
    "gensig options fault=crakc": "did you mean 'crack'?",
    "diagnose trian": "did you mean 'train'?",
    "diagnose generate": "a command of gensig",
    "diagnose train data=x out=y modle=cnn": "did you mean 'model'",
    "diagnose train data=x out=y model=cnnn": "did you mean 'cnn'?",
    "diagnose predict x.csv --modle y": "did you mean '--model'?",
    "diagnose detectability --speeds fast": "give numbers",
    "diagnose adapt --model x --healthy a.csv --method adabn --out y": "removed in 0.15",
    "gensig generate --config none out=x": "--config none does not exist",
    "gensig simulate --config x": "did you mean '--config-dir'?",
    "gensig plan --cfg hydra": "is not one of job",
    "gensig simulate -m fault=crack,wear": "gensig generate, gensig plan and diagnose",
    "gensig stiffness --multirun seed=1,2": "gensig generate, gensig plan and diagnose",
    "gensig generate --out x out=y": "out is given as a flag too",
    "gensig generate -j 0 out=x": "executor.n_workers = 0",
    "gensig stiffness --seed 3": "no flag '--seed'; type seed=N",
    "gensig simulate --out x.h5": "did you mean '--output'",
    "diagnose train --out x": "no flag '--out'; type out=DIR",
    "diagnose evaluate data=x modl=y": "there is data, out",
    "diagnose evaluate data=x model=y": "--model DIR",
    # files
    "gensig verify nothing": "nothing does not exist",
    "gensig resume nothing": "nothing does not exist",
    "gensig generate out=/proc/nothing plan.n_records=1": (
        "/proc takes no new folders or files; choose another out=DIR"
    ),
    "diagnose predict x.csv --model nothing": "nothing does not exist",
    "gensig stiffness --plot x.jpg": "must end in .png",
    "gensig stiffness --json nodir/x.json": "there is no folder nodir",
    "gensig modify-flank --out nodir/x.yaml": "there is no folder nodir",
    "gensig stiffness --config-dir nothing": "--config-dir",
    "gensig simulate operating.duration_s=0.01 --output x.txt": ".csv",
    "gensig simulate --twin": "--from DIR",
    "gensig verify .": "no gensig data set",
    "gensig inspect nothing": "does not exist",
    # overrides
    "gensig stiffness operating.speed_rp=3": "operating.speed_rpm",
    "gensig stiffness gaer=x": "gear",
    "gensig stiffness gear.pinion=3": "gear.pinion",
    "gensig stiffness ~fault": "fault",
    "gensig stiffness seed=[1": "override",
    "gensig generate fault crack out=x": "neither group=option nor key=value",
    "gensig generate falt=crack out=x": "did you mean 'fault'",
    "gensig generate fault=crakc out=x": "did you mean 'crack'?",
    "gensig generate fault=crack fault.crack_depth=1 out=x": "did you mean 'fault.crack_depth_mm'?",
    "gensig generate plan.classes=[crak] out=x": "did you mean 'crack'?",
    "gensig generate plan.classes=[worn] out=x": "did you mean 'wear'? there is broken",
    "gensig generate experiment=quikstart out=x": "did you mean 'quickstart'?",
    "gensig generate system=spurpair out=x": "did you mean 'spur_pair'?",
    "gensig generate operating.speed=1200 out=x": "'operating.speed_rpm'",
    "gensig generate operating.torque_nm=much out=x": "operating.torque_nm",
    "gensig generate operating.duration_s=1e-6 out=x": "operating.duration_s",
    "gensig generate mesh.law=onesided out=x": "mesh.law = 'onesided'; allowed: paper, one_sided",
    "gensig generate sensing.channels=[pinon_x] out=x": "allowed: pinion_x",
    "gensig generate dataset.compression=zip out=x": "gzip",
    "gensig generate dataset.sample_type=int8 out=x": "allowed: float32, int16",
    "gensig generate executor=slurm executor.shard_index=0 executor.shard_count=1 out=x": (
        "--freeze"
    ),
    "gensig plan --freeze": "out=DIR",
    "gensig generate executor=cuda out=x": "there is dask, local, slurm",
    "gensig generate executor.n_workers=0 out=x": "executor.n_workers",
    "gensig generate plan.n_records=0 out=x": "plan.n_records",
    "gensig generate plan.n_records=1.5e0 out=x": "plan.n_records = 1.5",
    "gensig simulate fault=crack fault.crack_depth_mm=0": "labelled crack",
    "gensig plan fault=wear fault.wear_depth_um=0": "labelled wear",
    "diagnose train data=x out=y seeds=3": "'seeds=[0,1,2]' trains three times",
    "gensig generate fault=crack,pitting out=x": "plan.classes=[crack,pitting]",
    "gensig generate fault=[crack,pitting] out=x": "fault=compound",
    "gensig plan operating.torque_nm=20,40": "type 'plan.vary={operating.torque_nm:",
    "gensig plan operating.torque_nm=[20,40]": "type 'plan.vary={operating.torque_nm:",
    "gensig simulate operating.torque_nm=20,40": "'plan.vary={operating.torque_nm:",
    "gensig generate plan.classes=[healthy, crack] out=x": (
        "quote it: 'plan.classes=[healthy, crack]'"
    ),
    "gensig generate fault=bearing out=x": "faults of bearings are not in this version",
    "gensig generate fault=outer_race out=x": "there is broken",
    "gensig generate -m seed=interval(1,3) out=x": "an interval has no end of values",
    "gensig generate -m fault=glob(q*) out=x": "matches no option",
    "gensig plan -m fault=crack,wear --freeze": "give out=DIR",
    "gensig plan -m fault=crack,wear out=x,y": "out must be one folder",
    "gensig generate out=": "give out=DIR",
    "gensig plan plan.vary={sensing.snr_db:{distribution:uniform,low:3}}": "low, high",
    f"gensig plan {uniform('operating.sped_rpm')}": "'operating.speed_rpm'",
    f"gensig plan {uniform('mesh.law')}": "mesh.law",
    f"gensig plan {uniform('gear.backlash_um')}": "-m",
    f"gensig plan {uniform('strength.bending_limit_mpa')}": "is one value for a whole data set",
    f"gensig plan {uniform('wear.threshold_um')}": "one value for a whole data set",
    "gensig plan wear.rule=rust": "wear.rule = 'rust'; allowed: band, fixed_intervals",
    "gensig plan excitation=engine_v20 plan.n_records=4": "excitation turns a drive line",
    "gensig simulate sensing.channels=[pinion_z]": "pinion_y",
    # gears and faults
    "gensig generate fault=crack fault.crack_depth_mm=-1 out=x": "crack_depth_mm",
    "gensig stiffness fault=crack fault.crack_depth_mm=4.2": "root chord",
    "gensig stiffness fault=crack fault.crack_depth_mm=3.6 fault.crack_width_mm=10": "checked",
    "gensig stiffness fault=crack fault.tooth=23": "0..22",
    "gensig stiffness fault=crack fault.pit_width_mm=3": "pit_width_mm",
    "gensig stiffness fault=pitting fault.pit_position_mm=9": "pit_position_mm",
    "gensig stiffness fault=pitting fault.pit_width_mm=21": "20 mm wide",
    "gensig stiffness fault=pitting fault.pit_depth_mm=3": "pit_depth_mm",
    "gensig stiffness gear.pinion.n_teeth=12": "undercut",
    "gensig stiffness mesh.body=sainsot gear.pinion.bore_radius_mm=2": "allow_extrapolation",
    "gensig stiffness gear.pinion.bore_radius_mm=18": "modules thick",
    "gensig stiffness gear.helix_angle_deg=10": "helix_angle_deg",
    "gensig stiffness material.poisson_ratio=0.7": "0.5",
    "gensig simulate gear.addendum_coefficient=0.5": "below 1",
    "gensig plan gear.addendum_coefficient=0.5": "below 1",
    "gensig generate gear.addendum_coefficient=0.5 out=x": "below 1",
    # slices and heat
    f"{FLANK} --out best.yaml fault=crack": "a modification is for healthy flanks",
    f"{FLANK} --out best.txt": "give a file NAME.yaml",
    f"{FLANK} --out best.yaml --points 0": "--points 0",
    f"{FLANK} --out best.yaml --torques -1": "must be positive",
    f"{ERROR} fault=crack fault.crack_depth_mm=1 fault.crack_width_mm=5": (
        "mesh.slice_coupling = 'independent' with a fault over part of the face"
    ),
    f"{ERROR} operating.torque_nm=0": "torque",
    f"{ERROR} mesh.n_slices=0": "mesh.n_slices = 0 must lie in 1..1000",
    f"{ERROR} gear.helix_angle_deg=60": "must lie between -45 and 45",
    f"gensig generate {SLICED} mesh.slices_in_phase=true out=never": (
        "slices_in_phase = true is for comparing"
    ),
    "gensig stiffness heat=chongqing_rated mesh.law=paper": "heat.growth opens gaps",
    f"gensig stiffness {HOT} heat=none mesh.heat_law=paper": "take heat=chongqing_rated or",
    f"gensig simulate {HOT} heat.growth=false mesh.heat_law=paper": "heat.growth=true",
    f"gensig stiffness {HOT} mesh.heat_law=hot": "allowed: grown, paper, paper_misprints",
    f"gensig stiffness {HOT} mesh.heat_law=paper mesh.body=ring": "take mesh.body=null or",
    f"gensig stiffness {HOT} mesh.heat_law=paper mesh.tooth=to_centreline": "mesh.tooth=null",
    "gensig plan heat=chongqing_rated mesh.heat_law=paper": "not for system=spur_pair",
    "gensig simulate system=two_stage_gearbox heat=chongqing_rated mesh.heat_law=paper": (
        "not for a drive line"
    ),
    "gensig simulate heat=chongqing_rated mesh.law=paper": "heat.growth opens gaps",
    f"gensig stiffness {HOT} heat.pinion_temperature_degc=400": "data, -75 to 300 degrees",
    f"gensig stiffness {HOT} mesh.friction_coefficient=0.5": "data, -75 to 300 degrees",
    f"gensig stiffness {HOT} heat.housing_temperature_degc=0": "the gears jam",
    # root stress
    "gensig root-stress fault=crack": "root stress is that of healthy teeth",
    "gensig root-stress --stress -1": "give a positive one",
    "gensig root-stress --stress nan": "give a positive one",
    "gensig root-stress operating.torque_nm=0": "operating.torque_nm = 0 must be positive",
    "gensig root-stress operating.torque_nm=-5 system=helical_pair": "must be positive",
    "gensig root-stress strength.bending_limit_mpa=0": (
        "strength.bending_limit_mpa = 0 must be positive"
    ),
    "gensig root-stress strength.bending_limit_mpa=steel": "is not a number",
    "gensig root-stress strength.load_point=middle": "allowed: outer_single_pair, tip",
    "gensig root-stress strength.edition=2001": "allowed: 2019, 2006",
    "gensig root-stress strength.bending_limit_gpa=1": "strength.bending_limit_gpa",
    "gensig root-stress strength=wood": "18cr2ni4w",
    "gensig root-stress gear.pinion.bore_radius_mm=20": "the rim between bore and root",
    "gensig root-stress gear=beihang_61_132": "system=helical_pair",
    # wear
    "gensig wear-life wear.threshold_um=9000": "is deeper than the tooth",
    "gensig wear-life wear.threshold=50": "did you mean 'wear.threshold_um'",
    "gensig wear-life wear.hardness_hbs=0": "wear.hardness_hbs = 0 must be positive",
    "gensig wear-life wear.coefficient=-1": "wear.coefficient = -1 must be positive",
    "gensig wear-life wear.wheel.coefficient=3": "wear.wheel.coefficient = 3 must be at most 1",
    "gensig wear-life wear.transmission_error_limit_um=1.3 --map": (
        "at 30 N m of the map: wear.transmission_error_limit_um"
    ),
    "gensig wear-life wear=rust": "no option 'rust' of wear; there is archard",
    "gensig wear-life fault=wear": "a life begins with healthy flanks",
    "gensig wear-life operating.speed_rpm=0": "speed",
    "gensig wear-life --out 'mine/worn wheel.yaml'": "NAME without spaces",
    "gensig wear-life --torques 50": "a map needs two torques or more",
    "gensig wear-life --speeds -5 5": "all positive",
    "gensig simulate gear=harbin_38_55 operating.duration_s=0.1": "contact ratio 0.9187 is below 1",
    f"{WORN} wear.vibration_limit_m_per_s2=1": "is reached by new flanks already",
    f"{WORN} wear.vibration_limit_m_per_s2=-1": "= -1 must be positive",
    f"{WORN} wear.vibration_rise_db=0": "wear.vibration_rise_db = 0 must be positive",
    f"{WORN} wear.vibration_rise_db=loud": "= 'loud' is not a number or null",
    f"{WORN} wear.vibration_rise=3": "did you mean 'wear.vibration_rise_db'",
    f"{WORN} wear.vibration_rise_db=3 sensing.channels=[pinion_rotation]": "name an acceleration",
    # maps of detectability
    "diagnose detectability": "fault=healthy: there is nothing to find",
    f"{DETECT} sensing.snr_db=null": "sensing.snr_db = null",
    f"{DETECT} sensing.snr_reference=record": "use healthy_twin",
    f"{DETECT} --n-units 3": "must be a whole number of at least 4",
    f"{DETECT} --speeds 900 900": "speeds in r/min: 900, 900; give positive numbers, each once",
    f"{DETECT} --torques -5": "torques in N m: -5; give positive numbers",
    f"{DETECT} --torques 0": "torques in N m: 0; give positive numbers",
    f"{DETECT} --speeds {' '.join(map(str, range(100, 501)))}": "more than 400 cells",
    f"{DETECT} --bandwidths 30000": "from 10 to half the sampling rate, 25600",
    f"{DETECT} --workers 0": "--workers 0 must be at least 1",
    f"{DETECT} --plot map.txt": "--plot map.txt: the name must end in .png",
    f"{DETECT} plan.n_gearboxes=0": "plan.n_gearboxes = 0",
    f"{DETECT} --torques 20 20": "torques in N m: 20, 20; give positive numbers",
    "diagnose detectability fault=missing_tooth --snrs 10": (
        "fault=missing_tooth has no single size"
    ),
    f"{DETECT} --sizes 1 1": "--sizes: 1, 1; give numbers, each once",
    f"{DETECT} --sizes 0 1": "crack_depth_mm = 0",
    f"{DETECT} --snrs 10 --speeds 900": "give operating.speed_rpm=RPM",
    f"{DETECT} --sizes 1 fault.crack_depth_mm=2": "given twice",
    f"{DETECT} --sizes deep": "give numbers",
    # drive lines
    (
        f"gensig forced-response {TRAIN} ~excitation operating.speed_rpm=1688 "
        "operating.torque_nm=100"
    ): "no excitation is chosen; take excitation=engine_v20",
    "gensig modes system=shaft_line": (
        "system.shafting_csv is required: give system.shafting_csv=FILE and system.gears_csv=FILE"
    ),
    f"gensig modes {TRAIN} system.gears_csv=null": "needs a table of gears; give system.gears_csv",
    f"gensig modes {TRAIN} system.shafting_csv=engine_gears": "column face_width_mm: unknown",
    f"gensig modes {TRAIN} system.viscous_damper_node=99": "has no such node",
    "gensig modes fault=crack": "modes are those of healthy teeth",
    f"{DAMPERS}5": "system.dampers = 5 must be a list of dampers, [] for none",
    f"{DAMPERS}[7]": "system.dampers[0] = 7 must be a group of keys",
    damper(node=99): "system.dampers: node 99 is not in the shaft line; it has 1 to 67",
    damper(inertia=0): "system.dampers[0].ring_inertia_kg_m2 = 0 must be positive",
    damper(
        damping=-1
    ): "system.dampers[0].damping_nms_per_rad = -1 must not be negative",
    damper(
        damping=0
    ): "system.dampers[0]: without damping and stiffness nothing holds the ring",
    damper(node="crank"): "system.dampers[0].node",
    f"{DAMPERS}'[{{node: 45, mass_kg: 1}}]'": "system.dampers[0]",
    f"gensig transmission-error {TRAIN}": "is a drive line from tables",
    f"gensig modify-flank {TRAIN} --out best.yaml": "is a drive line from tables",
    "gensig forced-response excitation=engine_v20": "system.kind = 'spur_pair' is no drive line",
    f"{STEADY} excitation=engine_v2": "no option 'engine_v2' of excitation",
    f"{STEADY} --nodes 99": "--nodes 99: the shaft line has no such node; it has 1 to 67",
    f"{STEADY} --run 900 700 10": "--run 900 700 10: give low, high and step",
    f"{STEADY} --torque -5": "the brake torque -5 N m is below the friction",
    f"{STEADY} --speed 0": "the speed of the crank, 0 r/min, must be positive",
    f"{STEADY} --speed 4000": "the follower leaves its cam at 2000 r/min of the camshaft",
    f"{STEADY} excitation.dynamometer.node=99 --nodes 14": (
        "excitation.dynamometer.node: the shaft line has no node 99"
    ),
    f"{STEADY} excitation.throw_nodes=[99,12,11,10,9,8,7,6,5,4]": (
        "excitation.throw_nodes: the shaft line has no"
    ),
    f"{STEADY} excitation.pressure.file=none.csv": "= none.csv cannot be read",
    f"{STEADY} excitation.pressure.file=none.csv --torque 5": "file decides the torque",
    f"{STEADY} --nodes 14 --sweep 900 700 5": "--sweep 900 700 5: give low and high speed",
    f"{STEADY} --nodes 14 --sweep 650 1750 0": "--sweep 650 1750 0: give low and high speed",
    f"{STEADY} --nodes 14 --sweep 650 1750 0.3": "cycles at its low end; give 0.81 s or more",
    f"{STEADY} --nodes 14 --time 0.01": "less than a cycle of two turns; simulate longer",
    f"{STEADY} --nodes 14 --mesh 3 45": "nodes 3 and 45 do not mesh; these do: 3/18",
    f"{PUMP} --nodes 99": "the shaft line has no node 99; it has 1 to 67",
    f"{PUMP} --nodes 45 45": "dampers on nodes 45, 45: name each node once",
    f"{PUMP} --run 900 700 10": "--run 900 700 10: give low, high and step",
    f"{PUMP} --most-inertia 0 --run 1700 1750 50": "give a positive one for each damper",
    f"{PUMP} --out 'my damper.yaml'": "give a file NAME.yaml in a folder system",
    f"{PUMP} excitation.pressure.file=none.csv": "file is of one operating point",
    f"{TUNE} excitation=engine_v20 --mesh 1 2": "system.kind = 'spur_pair' is no drive line",
    # a new gearbox
    "gensig new gearbox mine": "missing --teeth, --module, --speed, --torque",
    f"gensig new gearbox ../mine {SHEET}": "cannot be the name of a gearbox",
    f"gensig new gearbox null {SHEET}": "cannot be the name of a gearbox",
    f"gensig new gearbox xiamen_23_84 {SHEET}": "comes with gensig",
    f"{NEW} --teeth 9 40": "undercut; use at least",
    f"{NEW} --bores 60 60": "bore_radius_mm = 30 must lie between 0 and the root radius",
    f"{NEW} --bores 2": "thinner than any bearing",
    f"{NEW} --module -1": "--module -1 must be positive",
    f"{NEW} --module 0.0025": "--module 0.0025 must lie in 0.1 to 50: it is in mm",
    f"{NEW} --duration 0": "--duration 0 must be positive",
    f"{NEW} --classes healthy worn": "no option 'worn' of fault; did you mean 'wear'?",
    f"{NEW} --sensors top": "add --experiment realistic",
    f"{NEW} --speed-range 1400 1500": "give shares of the rated value",
    f"{NEW} --rate 1000": "above the usable band of 390.6 Hz",
    f"{NEW} --grade 20": "quality.iso1328_grade = 20 must lie in",
    f"{NEW} --widths 1 2 3": "--widths takes one number for both gears, or two",
    f"{NEW} --helix 60": "helix_angle_deg",
    f"{STAGES} --teeth 29 100 36": "of each stage, not 3",
    f"{STAGES} --teeth 29 100 0 90": "--teeth 0 must be positive",
    f"{STAGES} --teeth 29 100 36 9": "stage 2, 36/9: wheel: 9 teeth",
    f"{STAGES} --teeth 29 100": "--module takes one number for a pair of gears, not 2",
    f"{STAGES} --module 1 2 3": "--module takes one number for all stages, or 2",
    f"{STAGES} --module -2": "--module -2 must be positive",
    f"{STAGES} --widths 9 8 7": "--widths takes one number for all stages, or 2",
    f"{STAGES} --profile-shifts 0 1": "one number for all gears, or 4: one a gear",
    f"{STAGES} --bores 20": "--bores is for one pair of gears; edit bore_radius_mm",
    f"{STAGES} --supports 1e8": "is for one pair of gears; edit system.support",
    f"{STAGES} --sensors housing": "--sensors is for one pair of gears; records of a",
    f"{STAGES} --experiment realistic": "records of a drive line have no housing",
    f"{STAGES} --rate 1000": "--rate 1000: the mesh frequency reaches 870 Hz",
    f"{STAGES} --speed 0": "--speed 0 must be positive",
    # run-ups
    f"gensig simulate --orders r.csv {RAMP}": "orders over speed need 8",
    f"{ORDERS}=0.2": "changes by 5 % or less",
    f"{ORDERS}=1 operating.speed_profile=[[0,0.1],[0.3,1]]": (
        "orders over speed need 10 % or less"
    ),
    f"{ORDERS}=1 operating.speed_profile=[[0,1e-6],[1,1]]": "stands still or turns back",
    "gensig run-up operating.duration_s=0.2": "changes by 5 % or less",
    f"gensig run-up {RAMP}": "orders over speed need 8",
    f"gensig run-up {RAMP} sensing.channels=[pinion_rotation]": "accelerations in m/s2",
    # figures of papers
    f"{FIGURES} nope": "no such paper; take one of spur, helical_heat",
    f"{FIGURES} wear 12": "simulation draws figures 5, 6, 7, 8, 9, 10 of this paper",
}


@pytest.mark.parametrize("typed", REFUSED)
def test_a_mistake_is_one_line(typed, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    command, *words = shlex.split(typed)
    assert MAIN[command](words) == 2
    (line,) = [
        line
        for line in capsys.readouterr().err.splitlines()
        if not line.startswith(("gensig: note:", "searching for", "run-up of"))
    ]
    assert line.startswith(f"{command}: ")
    assert REFUSED[typed] in line
    assert not list(tmp_path.iterdir())
