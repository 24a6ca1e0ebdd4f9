//! The stages as processes, chained over files: bad input, interruption, full disks, looking at runs, reproducibility, and the files in `fixtures/`.

mod bad_input;
mod bad_numbers;
mod continued;
mod demos;
mod ends;
mod fixtures;
mod full_disk;
mod interrupted;
mod kills;
mod leaks;
mod places;
mod ppo;
mod reproducible;
mod resume;
mod runs;
mod seen;
