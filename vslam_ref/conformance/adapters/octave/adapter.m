function adapter()
% An adapter in MATLAB and GNU Octave: copy it, and put your own functions into the table in `value`.
%
%     vslam-ref verify --program "octave-cli --quiet --eval adapter" --topic so3 --topic se3
%     vslam-ref verify --program "matlab -batch adapter" --timeout 60 --topic so3
%
% in the folder of this file.  One request a line in, one reply a line out; nothing else may go to standard
% output: end each statement with a semicolon.
%
% Four traps, which this file goes round:
%   * what reads lines waits for more than a line: bytes are read one by one, with fread;
%   * jsondecode renames a field "function", which is no valid name: it is called "asked" before;
%   * jsonencode writes 15 digits, which are not enough for a double: numbers are written with 17 here;
%   * a row and a column are written alike: a matrix of one row or column is answered as matrix(x).
  requests = 0;
  if ~exist('OCTAVE_VERSION', 'builtin') && isunix
    requests = fopen('/dev/stdin', 'r');
  end
  while true
    line = next_line(requests);
    if isempty(line)
      return
    end
    if ~isempty(strtrim(line))
      fprintf(1, '%s\n', json(reply(line)));
      if exist('OCTAVE_VERSION', 'builtin')
        fflush(stdout);  % the other side waits for it
      end
    end
  end
end

% ---------------------------------------------------------------- 1 your functions

function R = so3_exp(phi)
% Rotation matrix of a rotation vector: I + a hat(phi) + b hat(phi)^2.
  angle = norm(phi);
  W = [0, -phi(3), phi(2); phi(3), 0, -phi(1); -phi(2), phi(1), 0];
  a = 1; b = 0.5;
  if angle > 1e-8
    a = sin(angle) / angle;
    b = 2 * (sin(angle / 2) / angle)^2;
  end
  R = eye(3) + a * W + b * W * W;
end

% ---------------------------------------------------------------- 2 the table
% 'vslam-ref vectors list' names all functions.  Vectors are columns here.

function [out, known] = value(name, in)
  known = true;
  switch name
    case 'so3.exp'
      out = so3_exp(number(in.phi));
    case 'se3.act'
      T = number(in.T);
      out = T(1:3, 1:3) * number(in.x) + T(1:3, 4);
    case 'camera.project'
      if ~strcmp(in.model, 'pinhole')
        known = false; out = [];  % a camera that this program does not have
        return
      end
      p = number(in.params); X = number(in.X_cam);
      if X(3) <= 0
        error('the point is not in front of the camera');
      end
      out = struct('uv', p(1:2) .* X(1:2) / X(3) + p(3:4), 'valid', true);
    otherwise
      known = false; out = [];
  end
end

% ---------------------------------------------------------------- 3 between the two: keep it

function said = reply(line)
  said = struct('id', '');
  try
    request = jsondecode(strrep(line, '"function"', '"asked"'));
    said.id = request.id;
    [out, known] = value(request.asked, request.inputs);
    if known
      said.value = out;
    else
      said.unsupported = true;
    end
  catch problem
    said.error = problem.message;
  end
end

function x = number(x)
% Numbers of a decoded value: the words "nan", "inf" and "-inf" stand for what is not finite.
  if ischar(x)
    x = str2double(x);
  elseif iscell(x)
    x = cellfun(@number, x, 'UniformOutput', false);
    if all(cellfun(@(row) numel(row) == 1, x))
      x = vertcat(x{:});
    else
      x = cell2mat(cellfun(@(row) row(:).', x, 'UniformOutput', false));
    end
  else
    x = double(x);
  end
end

function rows = matrix(x)
% A matrix as a list of rows, also where it has one row or one column.
  rows = arrayfun(@(k) num2cell(x(k, :)), 1:size(x, 1), 'UniformOutput', false);
end

function text = json(x)
  if isstruct(x)
    names = fieldnames(x);
    parts = cellfun(@(name) [json(name), ': ', json(x.(name))], names, 'UniformOutput', false);
    text = ['{', strjoin(parts(:).', ', '), '}'];
  elseif ischar(x)
    x = regexprep(regexprep(x, '([\\"])', '\\$1'), '[\x00-\x1f]', ' ');
    text = ['"', x, '"'];
  elseif iscell(x)
    text = ['[', strjoin(cellfun(@json, x(:).', 'UniformOutput', false), ', '), ']'];
  elseif isempty(x)
    text = '[]';
  elseif islogical(x) && isscalar(x)
    words = {'false', 'true'};
    text = words{x + 1};
  elseif isscalar(x)
    text = sprintf('%.17g', x);
    if ~isfinite(x)
      text = ['"', lower(text), '"'];
    end
  elseif isvector(x)
    text = json(num2cell(x(:).'));
  else
    text = json(matrix(x));
  end
end

function line = next_line(requests)
% A line with its end, byte by byte; empty at the end of the input.
  line = blanks(4096);
  count = 0;
  while true
    byte = fread(requests, 1, 'uint8');
    if isempty(byte)
      break
    end
    count = count + 1;
    if count > numel(line)
      line = [line, blanks(numel(line))];
    end
    line(count) = char(byte);
    if byte == 10
      break
    end
  end
  line = line(1:count);
end
