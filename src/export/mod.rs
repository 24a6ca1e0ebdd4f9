//! Policies for programs that are not hilt.

mod features;
pub mod onnx;
mod trigonometry;
