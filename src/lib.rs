//! hilt: hybrid imitation learning for robot manipulation, from a task's name to an evaluated policy.
//!
//! It implements Jung & Kim, *Hybrid Imitation Learning Framework for Robotic Manipulation Tasks*, Sensors 2021 (the paper). Every
//! stage of the pipeline is a command (`hilt help`) over the functions of this library.
//!
//! # The paper's ideas, and where they are
//!
//! | paper | here | what it is |
//! |---|---|---|
//! | s_t, a_t | [`state`], [`mod@layout`] | state (of the paper's robot 25 to 32 numbers: rad, rad/s, m, quaternions x y z w); a velocity for each joint \[rad/s, m/s\]; what each entry is |
//! | d = <(s_t^E, a_t^E)> | [`demo::Demo`] | a demonstration: T + 1 states, T actions |
//! | pi_theta | [`learn::Policy`] | Gaussian: mean network, log standard deviations |
//! | f_phi | [`learn::Dynamics`] | the next state from a state and an action |
//! | Algorithm 1: HIL; Eq. 1: L_mix | [`learn::methods::hil`] | BC and SC mixed by alpha, after a warm start; pure BC and SC are the same loop |
//! | alpha, its average and cap | [`learn::methods::mixing`] | alpha_e = d_conv, and the balance of the two gradients |
//! | Eq. 2: the update of theta | [`learn::methods::descent`] | Adam on the gradient of L_mix |
//! | Algorithm 2: BC; Eq. 3: L_BC | [`mod@learn::losses::behavior_cloning`] | loss on the demos' states |
//! | Eq. 4: p_t, d_conv | [`learn::losses::convergence`] | degree of policy convergence |
//! | Algorithm 3: SC; Eq. 5: L_SC; rho | [`mod@learn::losses::state_cloning`] | rollouts in f_phi, stochastic recovery, gradient through time |
//! | Algorithm 4 | [`sim::reexecute`], [`mod@learn::methods::pretrain_dynamics`] | demos executed again, pretraining of f_phi; [`learn::methods::fine_tuning`] goes on with it |
//! | Eq. 6: L_model | [`learn::losses::model_loss`] | loss of f_phi on observed transitions |
//! | BC + RL, which the paper compares with | [`learn::methods::bc_rl`] | BC, then L_RL + lambda L_BC |
//! | PPO, which the paper compares with | [`learn::methods::ppo`] | learns in the simulator from rewards alone |
//! | N(0, .001) on actions | [`sim`] | noise while demos are recorded and policies evaluated |
//! | tasks, milestones, success | [`task`], [`tasks`] | a task as its file says it; what follows from it, one file a kind of goal |
//! | staged reward | [`tasks::Monitor`] | each milestone once; [`tasks::dense`] is another, in every step |
//! | success rates | [`eval`] | seeded rollouts, Wilson intervals, failures by class |
//! | rho, alpha, tau, ... | [`config`] | every choice is a key; `pipelines/paper` sets them as literally as can work |
//!
//! # The modules, in the order in which data flow
//!
//! A module imports only from those before it, and no files import each other in circles; `tests/architecture` holds both.
//!
//! - leaves that all may use: [`error`], [`guard`], [`interrupt`], [`joints`] (a number a joint), [`math`], [`seed`], [`table`], [`tensor`], [`words`]
//! - [`nn`]: networks and their engine, knows no robots
//! - contracts: [`mod@layout`] (what the entries of a state and an action are: all that learning knows of robot and task), [`task`], [`state`], [`robot`] (robots from files: kinematics, distances, inverse kinematics), [`scene`] (who acts, and what stands where), [`demo`], [`mod@env`]; [`config`], [`pulse`]
//! - [`tasks`], then [`plan`] (scene to demonstration) and [`sim`] (contact physics, the only home of rapier)
//! - [`data`]: files, the only home of MCAP, Arrow, Parquet, safetensors and ONNX; knows no learning
//! - [`learn`]: networks of policy and dynamics, losses, methods, and the loop around them; knows neither files nor simulator
//! - [`eval`]: policies in the simulator
//! - [`export`]: policies for programs that are not hilt
//! - [`serve`]: policies and worlds over a wire, for programs of others; and theirs for hilt
//! - [`experiment`]: grids of runs as steps; starts no process
//! - [`report`]: pictures, pages to look at episodes, charts, tables, statistics over seeds, pages of experiments
//! - [`cmd`]: the command line
#![warn(missing_docs)]

pub mod cmd;
pub mod config;
pub mod data;
pub mod demo;
pub mod env;
pub mod error;
pub mod eval;
pub mod experiment;
pub mod export;
pub mod guard;
pub mod interrupt;
pub mod joints;
pub mod layout;
pub mod learn;
pub mod math;
pub mod nn;
pub mod plan;
pub mod pulse;
pub mod report;
pub mod robot;
pub mod scene;
pub mod seed;
pub mod serve;
pub mod sim;
pub mod state;
pub mod table;
pub mod task;
pub mod tasks;
pub mod tensor;
pub mod words;
